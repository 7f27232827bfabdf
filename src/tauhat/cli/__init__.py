"""The command line: `tauhat`."""
