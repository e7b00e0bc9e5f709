"""Toolchain: C sources enter; programs for the host, a Cortex-M4 in QEMU and an AVR in simavr leave.

So do C functions that are called as data. Whatever runs is a process of its own within limits.
"""
