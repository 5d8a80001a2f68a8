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

/// Memory in large pages where the system has them; not set to anything.
class LargeBlock {
  public:
    static constexpr size_t kPage = size_t(1) << 21;

    LargeBlock() = default;
    explicit LargeBlock(size_t bytes) : size_((bytes + kPage - 1) / kPage * kPage) {
        bytes_.reset(static_cast<std::byte *>(::operator new(size_, std::align_val_t(kPage))));
#ifdef __linux__
        madvise(bytes_.get(), size_, MADV_HUGEPAGE);
#endif
    }

    std::byte *data() const { return bytes_.get(); }
    size_t size() const { return size_; }

  private:
    struct Free {
        void operator()(std::byte *block) const { ::operator delete(block, std::align_val_t(kPage)); }
    };

    std::unique_ptr<std::byte, Free> bytes_;
    size_t size_ = 0;
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
    static constexpr size_t kBlock = 4 * LargeBlock::kPage, kAlign = 64;

    std::mutex mutex_;
    std::vector<LargeBlock> blocks_;
    size_t used_ = 0; // blocks
    std::byte *next_ = nullptr;
    size_t left_ = 0; // [bytes] of the block in use

    void *take(size_t bytes) {
        bytes = (bytes + kAlign - 1) / kAlign * kAlign;
        const std::lock_guard lock(mutex_);
        while (bytes > left_) {
            if (used_ == blocks_.size()) blocks_.emplace_back(std::max(kBlock, bytes));
            next_ = blocks_[used_].data(), left_ = blocks_[used_].size(), ++used_;
        }
        void *taken = next_;
        next_ += bytes, left_ -= bytes;
        return taken;
    }
};

} // namespace ringlet
