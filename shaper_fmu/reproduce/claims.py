"""The claims of a paper, and their verdicts by the FMUs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from shaper_fmu.page.blocks import Block
from shaper_fmu.renamed import warn_renamed

Verdict = Literal["reproduced", "reproduced (labels exchanged)", "not reproduced", "not decidable"]


@dataclass(frozen=True)
class Claim:
    """A statement of a paper and its verdict.

    Attributes:
        statement: the paper's statement, as a short quotation or close paraphrase, with its section or figure.
        number: the number found here, with its unit.
        verdict: "not decidable" where the paper does not say enough to try it; "reproduced (labels exchanged)" where it holds
            only if what the paper calls the first and the second are exchanged.
        why: what was run, and how it decides.
    """

    statement: str
    number: str
    verdict: Verdict
    why: str

    @property
    def words(self) -> str:
        """The old name of `statement`."""
        warn_renamed("Claim.words", "statement")
        return self.statement


@dataclass(frozen=True)
class Reproduction:
    """A paper run again.

    Attributes:
        key: its name on the command line and in file names: "pwm", "s-curve", "two-part", "partial-modes", ...
        title: title of the page.
        paper: authors, title, year.
        claims: every claim of the paper, in its order.
        blocks: figures and tables, which follow the claims on the page.
    """

    key: str
    title: str
    paper: str
    claims: list[Claim]
    blocks: list[Block]
