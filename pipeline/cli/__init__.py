"""The command line. Exit codes: 0 done, 1 a check failed, 2 wrong input."""
