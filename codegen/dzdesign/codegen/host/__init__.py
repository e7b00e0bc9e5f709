"""Target host: a shared library of the core for Windows, Linux and macOS, with a self-test."""
