"""Toolchain: C sources enter; programs for the host, a Cortex-M4 in QEMU and an AVR in simavr leave."""
