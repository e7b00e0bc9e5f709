"""A compensator in; its law as a function of MATLAB in integer arithmetic, and the C for a C Caller block, out."""
