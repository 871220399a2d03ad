"""The executables; they connect the other packages and compute nothing themselves.

An executable is the module of its name in its package (`executables.py` says which); the files
beside it are its parts. Imports between the packages point down only:

| package | executables | may import |
|---|---|---|
| `demo` | `demo` | `replay`, `shared` |
| `replay` | `replay` | `bags`, `shared` |
| `workbench` | `workbench` | `bags`, `shared` |
| `studies` | one for each study, such as `basins` | `bags`, `shared` |
| `bags` | `bag_report`, `bag_recover` | `shared` |
| `recorder` | `recorder` | `shared` |
| `live` | `perform`, `echo_impacts` | `shared` |
| `simulator` | `simulator` | `shared` |
| `shared` | what several packages share | |
"""
