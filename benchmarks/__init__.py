"""Measurements that claims of speed and accuracy rest on; `make bench` runs them."""
