"""The shaper as IEC 61131-3 structured text, for PLCs and motion controllers."""

from __future__ import annotations

import math

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.errors import ArgumentError
from shaper_fmu.tune.choice.reasons import rounded_up

LONGEST = 20000
"""Commands that are kept at most: 160 kB."""

_TEXT = """\
{about}
FUNCTION_BLOCK ShapedCommand
VAR_INPUT
    command : LREAL;    (* held until the next cycle *)
    cycle : LREAL;      (* time between two calls in s, the same at each; read at the first call *)
END_VAR
VAR_OUTPUT
    shaped : LREAL;     (* mean of the shaped command until the next cycle; to be held until then *)
    settled : BOOL;     (* nothing more is to come *)
    fault : BOOL;       (* cycle is not positive, or below {least} s: the command is passed on and NOT shaped *)
END_VAR
VAR
    amplitude : ARRAY[0..{last}] OF LREAL := [{amplitudes}];
    delay : ARRAY[0..{last}] OF LREAL := [{delays}]; (* s *)
    whole : ARRAY[0..{last}] OF DINT;       (* cycles of each delay *)
    part : ARRAY[0..{last}] OF LREAL;       (* what is left of a cycle, as a share *)
    history : ARRAY[0..{end}] OF LREAL;     (* the last commands, in a ring *)
    place : DINT;
    started : BOOL;
    quiet : DINT;                           (* cycles since the command has changed *)
    i : DINT;
    newer : DINT;
    older : DINT;
    periods : LREAL;
END_VAR

IF NOT started THEN
    (* before the first call the command is taken to have been the same for ever *)
    started := TRUE;
    FOR i := 0 TO {end} DO
        history[i] := command;
    END_FOR;
    quiet := {size};
    fault := NOT (cycle * {most} > delay[{last}]);
    IF NOT fault THEN
        FOR i := 0 TO {last} DO
            periods := delay[i] / cycle;
            whole[i] := LREAL_TO_DINT(periods);
            IF DINT_TO_LREAL(whole[i]) > periods THEN (* it is rounded *)
                whole[i] := whole[i] - 1;
            END_IF;
            part[i] := periods - DINT_TO_LREAL(whole[i]);
        END_FOR;
    END_IF;
END_IF;

older := place - 1;
IF older < 0 THEN
    older := older + {size};
END_IF;
IF command <> history[older] THEN
    quiet := 0;
ELSIF quiet < {size} THEN
    quiet := quiet + 1;
END_IF;
history[place] := command;
shaped := command;
settled := TRUE;
IF NOT fault THEN
    settled := quiet > whole[{last}];
    FOR i := 0 TO {last} DO
        newer := place - whole[i];
        IF newer < 0 THEN
            newer := newer + {size};
        END_IF;
        older := newer - 1;
        IF older < 0 THEN
            older := older + {size};
        END_IF;
        (* differences, so that a command at rest is passed on exactly *)
        shaped := shaped + amplitude[i] * ((1.0 - part[i]) * (history[newer] - command) + part[i] * (history[older] - command));
    END_FOR;
END_IF;
place := place + 1;
IF place >= {size} THEN
    place := 0;
END_IF;
END_FUNCTION_BLOCK
"""


def structured_text(sequence: ImpulseSequence, head: list[str], cycle: float) -> str:
    """A function block ShapedCommand with the impulses.

    It is called once a cycle, and serves cycles of `cycle` [s] and longer: it keeps as many commands as the shaper lasts. Its
    output is the mean of the shaped command over the cycle (`shaped_mean` of an InputShaper), so that impulses between cycles are
    as exact as a held output can be.

    Raises ArgumentError for a cycle that is not positive, or so short that more than `LONGEST` commands had to be kept.
    """
    if not 0.0 < cycle < math.inf:
        raise ArgumentError(f"cycle {cycle:g} s: it must be positive")
    size = math.floor(sequence.duration / cycle) + 3  # the longest delay, the command before it, and one to spare for rounding
    if size > LONGEST:
        shortest = rounded_up(sequence.duration / (LONGEST - 3))
        raise ArgumentError(
            f"a cycle of {cycle:g} s keeps {size} commands over {sequence.duration:.4g} s, more than {LONGEST}; "
            f"call the block at most every {shortest:.3g} s (--cycle)"
        )
    about = "\n".join(f"(* {line.replace('(*', '( *').replace('*)', '* )')} *)" for line in head)
    last = len(sequence.delays) - 1
    return _TEXT.format(
        about=about, last=last, end=size - 1, size=size, most=_literal(size - 1), least=f"{cycle:g}",
        amplitudes=", ".join(map(_literal, sequence.amplitudes)), delays=", ".join(map(_literal, sequence.delays)),
    )  # fmt: skip


def _literal(value: float) -> str:
    """A literal of LREAL: it needs a point, and a point before an exponent."""
    text = repr(float(value))
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.0'}E{int(exponent)}"
    return text
