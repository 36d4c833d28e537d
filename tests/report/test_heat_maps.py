"""Maps in a browser: colours, contour lines and values where they belong, zoom, keys, the table; values are a plane's, x + 2 y."""

from __future__ import annotations

import numpy as np
import pytest
from browser import Browser, browser, needs_chromium

from shaper_fmu.page.blocks import write_report
from shaper_fmu.page.figures import Map

pytestmark = needs_chromium
X, Y = np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 0.5, 2.0])
PLANE = X[None, :] + 2.0 * Y[:, None]
HOLE = np.where((X[None, :] > 3.5) & (Y[:, None] > 1.5), np.nan, PLANE)


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("map")
    panels = [("plane <b>", PLANE), ("with a hole", HOLE)]
    map_ = Map("plane", "A plane", "x [m]", "y [m]", "value [%]", X, Y, panels, [(4.0, "4 %"), (2.0, "2 %")], points=[(3.0, 0.5)])
    page = write_report(folder / "page.html", "Maps", [map_], pictures=())[0]
    with browser(folder) as chromium:
        chromium.open(page.as_uri(), width=1100)
        chromium.run("globalThis.map = document.getElementById('plane').chart; 0")
        yield chromium
        assert [said for said in chromium.console if "willReadFrequently" not in said] == []  # that is of the tests


def colour(chromium: Browser, panel: int, x: float, y: float) -> list[int]:
    return chromium.run(
        f"(({{ ctx, valToPos }}) => [...ctx.getImageData(valToPos({x}, 'x', true), valToPos({y}, 'y', true), 1, 1).data])(map.plots[{panel}])"
    )


def test_colours_are_those_of_the_values(shown):
    """Cividis between its ends, 0 and 8: matplotlib's own table."""
    from matplotlib import colormaps

    for x, y in ((0.3, 1.5), (2.0, 0.2), (3.6, 1.9), (0.5, 0.1)):
        wanted = np.array(colormaps["cividis"]((x + 2.0 * y) / 8.0)[:3]) * 255.0
        assert np.abs(np.array(colour(shown, 0, x, y)[:3]) - wanted).max() < 8.0, (x, y)


def test_what_is_missing_has_no_colour(shown):
    assert colour(shown, 1, 3.9, 1.9)[3] == 0
    assert colour(shown, 0, 3.9, 1.9)[3] == 255


def test_contour_lines_are_where_the_plane_has_their_value(shown):
    pieces = np.array(shown.run("mapContour(map.options.xs, map.options.ys, map.options.panels[0][1], 4)"))
    assert len(pieces) > 2
    np.testing.assert_allclose(pieces[:, 0] + 2.0 * pieces[:, 1], 4.0, atol=1e-12)
    np.testing.assert_allclose(pieces[:, 2] + 2.0 * pieces[:, 3], 4.0, atol=1e-12)
    assert min(colour(shown, 0, 2.6, 0.7)[:3]) > 240  # 4 = 2.6 + 2 * 0.7, in white
    assert shown.run("mapContour(map.options.xs, map.options.ys, map.options.panels[0][1], 9)") == []


def test_the_pointer_and_the_keys_show_values(shown):
    said = "document.querySelector('.map-said').textContent"
    shown.run("map.plots[1].setCursor({ left: -10, top: -10 })")
    assert "White lines: 4 % (thick), 2 %" in shown.run(said)
    shown.run("((u) => u.setCursor({ left: u.valToPos(2, 'x'), top: u.valToPos(1, 'y') }))(map.plots[1])")
    words = shown.run(said)
    assert words.startswith("with a hole: x [m] 2, y [m] ")
    y, value = (float(words.split(mark)[1].split(":")[0].split()[-1]) for mark in ("y [m] ", "value [%] "))
    assert value == pytest.approx(2.0 + 2.0 * y, abs=0.02)
    shown.run("document.querySelectorAll('#plane .u-over')[1].focus()")
    shown.key("ArrowUp")
    assert shown.run(said) != words
    shown.run("map.plots[1].setCursor({ left: map.plots[1].valToPos(3.9, 'x'), top: map.plots[1].valToPos(1.9, 'y') })")
    assert shown.run(said).endswith("value [%] –")


def test_dragging_zooms_all_panels_and_a_double_click_shows_all(shown):
    ends = "map.plots.map(({ scales }) => [scales.x.min, scales.x.max, scales.y.min, scales.y.max])"
    assert shown.run(ends) == [[0, 4, 0, 2]] * 2
    x, y, width, height = shown.box("#plane .u-over")
    shown.drag((x + 0.25 * width, y + 0.25 * height), (x + 0.75 * width, y + 0.75 * height))
    first, second = shown.run(ends)
    assert first == second
    assert first == pytest.approx([1.0, 3.0, 0.5, 1.5], abs=0.05)
    shown.run("document.querySelector('#plane .u-over').dispatchEvent(new MouseEvent('dblclick', { bubbles: true }))")
    assert shown.run(ends) == [[0, 4, 0, 2]] * 2


def test_the_table_has_every_value(shown):
    text = shown.run("new Promise((done) => { map.save = (blob) => blob.text().then(done); map.saveTable(); })")
    head, *rows = text.splitlines()
    assert head == '"x [m]","y [m]","value [%], plane <b>","value [%], with a hole"'
    found = np.array([[float(cell or "nan") for cell in row.split(",")] for row in rows])
    np.testing.assert_array_equal(found[:, 2].reshape(PLANE.shape), PLANE)
    np.testing.assert_array_equal(found[:, 3].reshape(PLANE.shape), HOLE)


def test_the_picture_has_all_panels(shown):
    size = "((c) => [c.width, c.height, map.plots[0].ctx.canvas.width])(map.picture())"
    width, height, one = shown.run(size)
    assert width >= 2 * one
    assert height > 300
