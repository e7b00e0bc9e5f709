"""What tests share: recordings with a known truth, models of devices, readers of pages, folders."""
