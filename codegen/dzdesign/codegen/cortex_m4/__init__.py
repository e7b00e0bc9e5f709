"""Target cortex-m4: ARM Cortex-M4 without CMSIS, its own start-up code; runs in QEMU."""

if __name__ != "dzdesign.codegen.cortex_m4":
    raise ImportError("import this room as dzdesign.codegen.cortex_m4")
