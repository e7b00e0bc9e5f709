"""What a release is made of: `make dist` builds it in dist/. The sources enter; wheel, source package, pages, list of
components and checksums leave. Nothing here is installed.
"""
