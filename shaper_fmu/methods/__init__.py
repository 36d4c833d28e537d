"""Methods that declare themselves: each shaper, profile and pulse design is one file with a complete record.

`record` is what a method tells, `discovery` finds the records, `dispatch` makes the text of a module from them: the enumeration,
and the functions of kernels that ask the method of a kind. docs/extending.md shows how a method is written.
"""
