"""Measurements that show what the project promises, on this machine, in one command."""
