"""The executables of a run: they connect the other folders and compute nothing themselves.

An executable is the module of its name; `executables.py` says which. The files beside it are its
parts.
"""
