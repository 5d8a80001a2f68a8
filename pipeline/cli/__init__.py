"""The command line: the only module that knows every stage. Exit codes: 0 done, 1 a check failed, 2 wrong input."""
