"""The executables: wiring only.

An executable is the module of its name in its room (`executables.py` says which); the files beside
it are its parts. Imports between the rooms point down only:

| room | executables | may import |
|---|---|---|
| `demo` | `demo` | `replay`, `shared` |
| `replay` | `replay` | `bags`, `shared` |
| `studies` | one for each study, such as `basins` | `bags`, `shared` |
| `bags` | `bag_report`, `bag_recover` | `shared` |
| `recorder` | `recorder` | `shared` |
| `live` | `perform`, `echo_impacts` | `shared` |
| `simulator` | `simulator` | `shared` |
| `shared` | what several rooms need | |
"""
