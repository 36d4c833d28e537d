"""Maps: their data, the page, the picture."""

from __future__ import annotations

import numpy as np
import pytest
from report_pages import figures_of
from test_cli import Resources

from shaper_fmu.page.blocks import Table, Text, write_report
from shaper_fmu.page.figures import Figure, Line, Map

X, Y = np.linspace(-2.0, 2.0, 41), np.linspace(-1.0, 1.0, 31)
DISTANCE = np.hypot(*np.meshgrid(X, Y))


def a_map(panels: int = 1, **options) -> Map:
    """Distances from the middle: contour lines are circles."""
    shown = [(f"panel {i}", (i + 1) * DISTANCE) for i in range(panels)]
    return Map("distance", "Distance", "x [m]", "y [m]", "distance [m]", X, Y, shown, [(0.5, "0.5 m"), (1.0, "1 m")], **options)


@pytest.mark.parametrize(("panels", "grid"), [(1, (1, 1)), (2, (1, 2)), (3, (1, 3)), (4, (2, 2)), (5, (2, 3)), (9, (3, 3))])
def test_panels_are_laid_out(panels, grid):
    assert a_map(panels).grid() == grid


def test_one_scale_for_all_panels():
    assert a_map(2).scale() == (0.0, 2.0 * DISTANCE.max())
    assert a_map(2, largest=1.5).scale() == (0.0, 1.5)
    below = Map("m", "", "", "", "", X, Y, [("", DISTANCE - 3.0)])
    assert below.scale() == ((DISTANCE - 3.0).min(), (DISTANCE - 3.0).max())


def test_values_of_another_shape_are_refused():
    with pytest.raises(ValueError, match=r"panel 'p' has the shape \(41, 31\), but its axes ask for \(31, 41\)"):
        Map("m", "", "", "", "", X, Y, [("p", DISTANCE.T)])


def test_a_page_with_maps_figures_and_words(tmp_path):
    words = Table("Claims", ["claim", "why"], [["<b>", "1 < 2"]], left_aligned=True)
    blocks = [Text("first"), words, a_map(2, points=[(0.5, 0.0)]), Figure("line", "Line", "x", "y", [Line("l", X, X)])]
    paths = write_report(tmp_path / "page.html", "A page", blocks)
    assert [path.name for path in paths] == ["page.html", "page_distance.png", "page_line.png"]
    page = paths[0].read_text()
    resources = Resources()
    resources.feed(page)
    assert (resources.found, resources.tables) == ([], 1)
    assert '<table class="left-aligned ' in page
    assert ">&lt;b&gt;</td>" in page
    told = figures_of(page)["distance"]
    assert [name for name, _ in told["panels"]] == ["panel 0", "panel 1"]
    np.testing.assert_allclose(told["panels"][0][1], DISTANCE, rtol=6e-4)  # four digits
    np.testing.assert_allclose(told["panels"][1][1], 2.0 * DISTANCE, rtol=6e-4)
    assert (told["levels"], told["points"]) == ([[0.5, "0.5 m"], [1, "1 m"]], [[0.5, 0]])


def test_the_picture_is_readable_in_grey(tmp_path):
    """Without contour lines the picture's brightness rises with the value, and the ends differ by half the range at least."""
    from matplotlib.image import imread

    rising = Map("distance", "", "", "", "", X, Y, [("", np.tile(X, (len(Y), 1)))])
    picture = write_report(tmp_path / "page.html", "", [rising])[1]
    pixels = imread(picture)[:, :, :3] @ np.array([0.299, 0.587, 0.114])
    row = pixels[pixels.shape[0] // 2]
    coloured = np.flatnonzero((row > 0.05) & (row < 0.95))
    inner = row[coloured[10] : coloured[0] + int(0.5 * pixels.shape[1])]
    assert np.all(np.diff(inner[::10]) > -0.01)
    assert inner[-1] - inner[0] > 0.4
