"""FMUs of a compensator and of the plant for simulation tools, FMI 2.0.

A `Compensator` and, where there is one, the plant's parameters enter; the files of a folder leave. The C of the law is
that of the firmware; what stands around it is in ``templates/``. A simulation tool's own binaries are made by ziglang.
"""
