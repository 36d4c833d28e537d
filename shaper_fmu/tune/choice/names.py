"""Names of candidates that tell them apart."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from shaper_fmu.tune.choice.candidates import Factor
from shaper_fmu.tune.choice.search import Candidate, Dominated


def told_apart(
    candidates: Sequence[Candidate], dominated: Iterable[Dominated]
) -> tuple[tuple[Candidate, ...], tuple[Dominated, ...]]:
    """The same with different names: those that are equal get in which of tolerance, frequency and damping ratio they differ."""
    names = _different(candidates)
    renamed = {id(one): replace(one, name=name) if name != one.name else one for one, name in zip(candidates, names, strict=True)}
    return tuple(renamed.values()), tuple(replace(one, by=renamed.get(id(one.by), one.by)) for one in dominated)


def _different(candidates: Sequence[Candidate]) -> list[str]:
    names = [one.name for one in candidates]
    for ways in (_tolerance,), (_tolerance, _frequency), (_tolerance, _frequency, _damping), None:
        equal = {name for name, count in Counter(names).items() if count > 1}
        if not equal:
            break
        groups = {name: [one for one in candidates if one.name == name] for name in {one.name for one in candidates}}
        seen: Counter[str] = Counter()
        for k, one in enumerate(candidates):
            if names[k] not in equal:
                continue
            if ways is None:
                seen[names[k]] += 1
                names[k] = f"{names[k]} [{seen[names[k]]}]"
                continue
            said = [text for way in ways if (text := _said(way, one, groups[one.name]))]
            names[k] = f"{one.name} ({', '.join(said)})" if said else one.name
    return names


def _said(way: Callable[[Factor], str], one: Candidate, group: Sequence[Candidate]) -> str:
    """What a way of telling says of a candidate; "" if it says the same of all with its name."""
    texts = [" and ".join(dict.fromkeys(filter(None, map(way, other.design.factors)))) for other in group]
    mine = next(text for text, other in zip(texts, group, strict=True) if other is one)
    return mine if len(set(texts)) > 1 else ""


def _tolerance(factor: Factor) -> str:
    return f"for {100.0 * factor.tolerance:.4g} %" if factor.tolerance else ""


def _frequency(factor: Factor) -> str:
    return f"{' and '.join(f'{w:.8g}' for w in factor.frequencies)} rad/s"


def _damping(factor: Factor) -> str:
    return f"damping ratio {' and '.join(f'{zeta:.3g}' for zeta in factor.dampings)}"
