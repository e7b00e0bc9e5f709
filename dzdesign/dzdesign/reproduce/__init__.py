"""Reproduce: the paper's valves through the whole product, each printed number beside ours."""
