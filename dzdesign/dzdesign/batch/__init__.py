"""`dzdesign batch`: recordings of many valves in, a folder a valve and one table of all out.

`calibration` is what is done with one valve, wherever that runs; `runners` are where; the client alone writes files.
"""
