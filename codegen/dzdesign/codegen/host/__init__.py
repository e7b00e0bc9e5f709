"""Target host: a shared library of the core for Windows, Linux and macOS, with a self-test."""

if __name__ != "dzdesign.codegen.host":
    raise ImportError("import this room as dzdesign.codegen.host")
