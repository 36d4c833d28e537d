"""Methods that declare themselves: each shaper, profile and pulse design is one file with a complete record.

`record` is the base of the records, `discovery` finds them, `dispatch` generates the source of a module from them: the enumeration,
and the functions of kernels that ask the method of a kind. docs/extending.md shows how a method is written.
"""
