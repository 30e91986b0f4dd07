"""A package, so that pytest closes the one browser after the last of its tests."""
