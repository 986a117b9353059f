"""Puts this directory on the import path, for `measure`."""
