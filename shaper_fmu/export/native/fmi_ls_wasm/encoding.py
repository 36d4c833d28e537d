"""A module of WebAssembly with an FMU's functions, wrapped as the component that the draft of fmi-ls-wasm asks for.

The component is written as text, which the package `wasmtime` encodes; the module is put into its place in the binary then, since
the text has no form for a module that is binary. The structure is that of the Bytecode Alliance's own encoder, which other tools
read. A module can be made only once what it imports is there, and the log message's canonical form needs the module's memory. So
the module calls through a table, which is filled afterwards.
"""

from __future__ import annotations

from collections.abc import Iterable

from shaper_fmu.export.native.fmi_ls_wasm.interfaces import (
    CO_SIMULATION,
    GET_VERSION,
    LOG_MESSAGE,
    MODEL_EXCHANGE,
    PACKAGE,
    TYPES,
    VERSION,
    Function,
    Interface,
    Type,
    function_of,
    type_of,
)

_CUSTOM, _CORE_MODULE, _COMPONENT = 0, 1, 4
"""Numbers of sections: names and the like; a module; a component inside."""

_TABLE = """\
  (core module $indirect
    (type $log (func (param i32 i32 i32 i32 i32 i32 i32)))
    (type $drop (func (param i32)))
    (table (export "$imports") {size} {size} funcref)
    (func (export "log") (param i32 i32 i32 i32 i32 i32 i32)
      local.get 0 local.get 1 local.get 2 local.get 3 local.get 4 local.get 5 local.get 6
      i32.const 0 call_indirect (type $log))
{drops}  )
  (core module $fill
    (type $log (func (param i32 i32 i32 i32 i32 i32 i32)))
    (type $drop (func (param i32)))
    (import "" "$imports" (table {size} {size} funcref))
    (import "" "log" (func $f0 (type $log)))
{imports}    (elem (i32.const 0) func {functions}))
  (core module $first
    (import "" "initialize" (func $initialize))
    (start $initialize))
"""


def wrapped(module: bytes, exchange: bool) -> bytes:
    """The component, with model exchange beside co-simulation if the FMU has it."""
    from wasmtime import wat2wasm

    text = component_text([CO_SIMULATION, *([MODEL_EXCHANGE] if exchange else [])])
    return _without_names(bytes(wat2wasm(text)), module)


def component_text(interfaces: list[Interface]) -> str:
    """The component as text, with an empty module in place of the FMU's."""
    lines = [
        _import("types", _declared(TYPES)),
        *[f'  (alias export $types "{name}" (type ${name}))\n' for name in TYPES],
        _import(
            "callbacks",
            '    (alias outer 1 $status (type $outer))\n    (export "status" (type $status (eq $outer)))\n'
            f'    (export "log-message" (func {_signature(function_of(LOG_MESSAGE))}))\n',
        ),
        "  (core module)\n",
        _table(interfaces),
        _instances(interfaces),
        _exported("common", {}, [(GET_VERSION, "")], ""),
    ]
    for interface in interfaces:
        name, text = interface.record
        lines.append(f"  (type ${name} {_text(type_of(text))})\n")
        functions = [
            (interface.instantiate, f"[static]{interface.resource}."),
            *[(m, f"[method]{interface.resource}.") for m in interface.methods],
        ]
        lines.append(_exported(interface.name, {**TYPES, name: text}, functions, interface.resource))
    return f"(component\n{''.join(lines)})\n"


def _named(interface: str) -> str:
    return f"{PACKAGE}/{interface}@{VERSION}"


def _import(interface: str, declarations: str) -> str:
    return f'  (import "{_named(interface)}" (instance ${interface}\n{declarations}  ))\n'


def _declared(types: dict[str, str]) -> str:
    return "".join(
        f"    (type ${name}-type {_text(type_of(text))})\n" + f'    (export "{name}" (type ${name} (eq ${name}-type)))\n'
        for name, text in types.items()
    )


def _table(interfaces: list[Interface]) -> str:
    drops = range(1, len(interfaces) + 1)
    drop = '    (func (export "{0}") (param i32) local.get 0 i32.const {1} call_indirect (type $drop))\n'
    return _TABLE.format(
        size=len(interfaces) + 1,
        drops="".join(drop.format(interface.name, i) for i, interface in enumerate(interfaces, 1)),
        imports="".join(
            f'    (import "" "{interface.name}" (func $f{i} (type $drop)))\n' for i, interface in enumerate(interfaces, 1)
        ),
        functions=" ".join(f"$f{i}" for i in (0, *drops)),
    )


def _instances(interfaces: list[Interface]) -> str:
    """The modules' instances: the table, the FMU with what it imports, and the table filled with that of the FMU."""
    created, given, filled = [], [], ['(export "log" (func $log))']
    for interface in interfaces:
        resource, full = interface.resource, _named(interface.name)
        drop = f'(core func $indirect "{interface.name}")'
        created.append(f"  (type ${resource} (resource (rep i32) (dtor {drop})))\n")
        created.append(f"  (core func $new-{resource} (canon resource.new ${resource}))\n")
        new = f'(instance (export "[resource-new]{resource}" (func $new-{resource})))'
        given.append(f'    (with "[export]{full}" {new})\n')
        filled.append(f'(export "{interface.name}" (func $main "{full}#[dtor]{resource}"))')
    log = '(instance (export "log-message" (func $indirect "log")))'
    table = f'(instance (export "$imports" (table $indirect "$imports")) {" ".join(filled)})'
    return f"""\
  (core instance $indirect (instantiate $indirect))
{"".join(created)}  (core instance $main (instantiate 0
    (with "{_named("callbacks")}" {log})
{"".join(given)}  ))
  (alias core export $main "memory" (core memory $memory))
  (alias core export $main "cabi_realloc" (core func $realloc))
  (core func $log (canon lower (func $callbacks "log-message") (memory $memory)))
  (core instance (instantiate $fill (with "" {table})))
  (core instance (instantiate $first (with "" (instance (export "initialize" (func $main "_initialize"))))))
"""


def _exported(name: str, types: dict[str, str], functions: list[tuple[str, str]], resource: str) -> str:
    """Functions of the module as functions of an exported interface: (declaration, what comes before the name).

    Where they speak of a resource and of named types, it must be of those that the same interface exports. That takes a component
    inside, which imports functions and types and exports them under their names.
    """
    lifted, inside, exported, given = [], [], [], []
    shown = [kind for kind in (*types, resource) if kind and kind != "dependency-kind"]  # which the draft leaves out
    for kind, text in types.items():
        inside.append(f"    (type ${kind}-type {_text(type_of(text))})\n")
        inside.append(f'    (import "import-type-{kind}" (type ${kind} (eq ${kind}-type)))\n')
    if resource:
        inside.append(f'    (import "import-type-{resource}" (type ${resource} (sub resource)))\n')
    given += [f'(with "import-type-{kind}" (type ${kind}))' for kind in (*types, resource) if kind]
    exported += [f'    (export $out-{kind} "{kind}" (type ${kind}))\n' for kind in shown]
    for text, prefix in functions:
        function = function_of(text)
        if prefix.startswith("[method]"):
            self = ("self", Type("borrow", (("", Type(resource)),)))
            function = function._replace(parameters=(self, *function.parameters))
        full = prefix + function.name
        plain = full.translate({ord("["): None, ord("]"): "-", ord("."): "-"})
        lift = f'(canon lift (core func $main "{_named(name)}#{full}") (memory $memory) (realloc $realloc))'
        lifted.append(f"  (func ${name}-{plain} {_signature(function)} {lift})\n")
        inside.append(f'    (import "import-func-{plain}" (func ${plain} {_signature(function)}))\n')
        exported.append(f'    (export "{full}" (func ${plain}) (func {_signature(function, shown)}))\n')
        given.append(f'(with "import-func-{plain}" (func ${name}-{plain}))')
    return (
        f"{''.join(lifted)}  (component ${name}-exports\n{''.join([*inside, *exported])}  )\n"
        f"  (instance ${name} (instantiate ${name}-exports {' '.join(given)}))\n"
        f'  (export "{_named(name)}" (instance ${name}))\n'
    )


def _signature(function: Function, exported: Iterable[str] = ()) -> str:
    found = [f'(param "{name}" {_text(kind, exported)})' for name, kind in function.parameters]
    return " ".join([*found, *([f"(result {_text(function.result, exported)})"] if function.result else [])])


def _text(kind: Type, exported: Iterable[str] = ()) -> str:
    """A type in the text format, declared ones by their names in scope."""
    parts = [(name, _text(part, exported)) for name, part in kind.parts]
    match kind.head:
        case "":
            return ""
        case "enum":
            return f"(enum {' '.join(f'{chr(34)}{name}{chr(34)}' for name, _ in parts)})"
        case "record":
            return f"(record {' '.join(f'(field {chr(34)}{name}{chr(34)} {part})' for name, part in parts)})"
        case "result":
            return f"(result {parts[0][1]} (error {parts[1][1]}))"
        case "list" | "option" | "tuple" | "own" | "borrow":
            return f"({kind.head} {' '.join(part for _, part in parts)})"
        case head if head in exported:
            return f"$out-{head}"
        case head if head in TYPES or head.endswith(("-result", "-instance")):
            return f"${head}"
    return kind.head


def _without_names(component: bytes, module: bytes = b"") -> bytes:
    """The component without what names its parts, half of its size, and with this module in place of its first."""
    parts, at = [component[:8]], 8
    while at < len(component):
        section, (size, at) = component[at], _number(component, at + 1)
        content = component[at : at + size]
        at += size
        if section == _CORE_MODULE and module:
            content, module = module, b""
        elif section == _COMPONENT:
            content = _without_names(content)
        if section != _CUSTOM:
            parts.append(bytes([section]) + _leb(len(content)) + content)
    return b"".join(parts)


def _leb(number: int) -> bytes:
    """A number without sign, as WebAssembly writes it (LEB128)."""
    groups = [number >> shift & 0x7F for shift in range(0, max(number.bit_length(), 1), 7)]
    return bytes([*[group | 0x80 for group in groups[:-1]], groups[-1]])


def _number(content: bytes, at: int) -> tuple[int, int]:
    """Such a number, and where it ends."""
    number = shift = 0
    while content[at] & 0x80:
        number |= (content[at] & 0x7F) << shift
        shift, at = shift + 7, at + 1
    return number | content[at] << shift, at + 1
