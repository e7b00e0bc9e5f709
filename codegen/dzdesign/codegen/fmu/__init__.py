"""An FMU of the compensator for simulation tools, FMI 2.0.

A `Compensator` enters, the files of a folder leave. The C of the law is that of the firmware; what stands around it is
in ``templates/``. A simulation tool's own binaries are made by ziglang.
"""
