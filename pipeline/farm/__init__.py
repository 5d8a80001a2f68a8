"""Many processes, on this machine or on many: stages and chunks of frames as tasks of Dask distributed (extra `farm`).

Tasks know paths and keys, never arrays: what they make goes to the outputs folder, which all machines share. A task runs
at least once, maybe twice: files appear whole, and what is fresh is not made again.
"""
