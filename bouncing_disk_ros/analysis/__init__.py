"""Analysis of impacts and states, from arrays: orbits, attractors, basins, estimates, reports.

Imports between the packages point down only:

| package | what it holds | may import |
|---|---|---|
| `report` | the report on a recorded run: numbers, tables, figures, words | `recorded` |
| `recorded` | what recorded impacts and states show | `dynamics` |
| `dynamics` | the next-collision map as a dynamical system | |
| `toss` | single tosses | |

All may import the files beside them, which know closed forms and scales alone, and `core`.
"""
