// Memory that many small arrays are copied into, and that goes all at once.
//
// It comes in large pages where the system has them: what is read here and there misses the processor's table of pages
// (4 kB each) at nearly every read, which costs more than the read.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace ringlet {

/// An array in an arena.
template <class T> struct Span {
    T *data = nullptr;
    size_t size = 0;

    T &operator[](size_t i) const { return data[i]; }
};

class Arena {
  public:
    /// Copies an array; may be called from many threads.
    template <class T> Span<T> copy(const std::vector<T> &from) {
        const size_t bytes = from.size() * sizeof(T);
        T *to = static_cast<T *>(take(bytes));
        std::memcpy(to, from.data(), bytes);
        return {to, from.size()};
    }

    /// Forgets the arrays; the memory is used again.
    void clear() { used_ = 0, left_ = 0; }

  private:
    static constexpr size_t kPage = size_t(1) << 21, kBlock = 4 * kPage, kAlign = 64;

    struct Free {
        void operator()(std::byte *block) const { ::operator delete(block, std::align_val_t(kPage)); }
    };
    struct Block {
        std::unique_ptr<std::byte, Free> bytes;
        size_t size;
    };

    std::mutex mutex_;
    std::vector<Block> blocks_;
    size_t used_ = 0; // blocks
    std::byte *next_ = nullptr;
    size_t left_ = 0; // [bytes] of the block in use

    void *take(size_t bytes) {
        bytes = (bytes + kAlign - 1) / kAlign * kAlign;
        const std::lock_guard lock(mutex_);
        while (bytes > left_) {
            if (used_ == blocks_.size()) allocate(std::max(kBlock, (bytes + kPage - 1) / kPage * kPage));
            next_ = blocks_[used_].bytes.get(), left_ = blocks_[used_].size, ++used_;
        }
        void *taken = next_;
        next_ += bytes, left_ -= bytes;
        return taken;
    }

    void allocate(size_t size) {
        std::unique_ptr<std::byte, Free> bytes(static_cast<std::byte *>(::operator new(size, std::align_val_t(kPage))));
#ifdef __linux__
        madvise(bytes.get(), size, MADV_HUGEPAGE);
#endif
        blocks_.push_back({std::move(bytes), size});
    }
};

} // namespace ringlet
