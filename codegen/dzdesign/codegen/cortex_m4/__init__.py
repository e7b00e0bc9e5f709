"""Target cortex-m4: ARM Cortex-M4 without CMSIS, its own start-up code; runs in QEMU."""
