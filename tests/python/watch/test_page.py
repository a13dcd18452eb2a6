"""The live page in headless Chromium, as its users see and touch it."""

from __future__ import annotations

import itertools
import json
import re
import signal
import subprocess
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
import screenshot
from lever_cdkf.can import codec
from processes import PATIENCE
from python.watch.browser import Browser

pytestmark = pytest.mark.requires("|".join(screenshot.BROWSERS))

Start = Callable[..., "subprocess.Popen[str]"]
CONDITION = "document.getElementById('condition').textContent"


def address(process: subprocess.Popen[str]) -> str:
    """Return the address of the page, which the command prints first."""
    assert process.stdout is not None
    line = process.stdout.readline()
    match = re.search(r"http://\S+/", line)
    assert match, line
    return match[0]


def end(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=PATIENCE)[1] == "lever: interrupted\n"


def estimates(browser: Browser) -> dict[str, list[str]]:
    """Value, sigma, unit and truth by the name that the page shows."""
    rows: list[list[str]] = browser.run(
        "Array.from(document.querySelectorAll('#estimates tr'), row => Array.from(row.cells, cell => cell.textContent))"
    )
    return {name: rest for name, *rest in rows}


def drawn(browser: Browser, canvas: str) -> int:
    """Return how many colours a canvas shows."""
    script = """(() => {
      const canvas = document.querySelector(%s), pen = canvas.getContext('2d');
      const data = new Uint32Array(pen.getImageData(0, 0, canvas.width, canvas.height).data.buffer);
      return new Set(data).size; })()"""
    return int(browser.run(script % json.dumps(canvas)))


def choose(browser: Browser, selector: str, value: str) -> None:
    """As if the user had chosen it from the list."""
    script = "(() => { const e = document.querySelector(%s); e.value = %s; e.dispatchEvent(new Event('change')); })()"
    browser.run(script % (json.dumps(selector), json.dumps(value)))


@pytest.fixture
def desktop(browser: Browser) -> Browser:
    browser.begin()
    return browser


def test_a_session(desktop: Browser, start_lever: Start) -> None:
    process = start_lever("live", "--scenario", "steady", "--port", "0")
    url = address(process)
    desktop.open(url)
    desktop.wait(f"{CONDITION}.startsWith('run')")
    # The standard deviations come in frames of their own, after those of the values.
    desktop.wait("Array.from(document.querySelectorAll('#estimates .sigma'), e => e.textContent).every(Boolean)")
    shown = estimates(desktop)
    assert list(shown) == ["mp mass", "cp damping", "kp stiffness", "fn natural frequency", "ζ damping ratio"]
    value, sigma, unit, truth = shown["kp stiffness"]
    assert 500 < float(value) < 5000
    assert re.fullmatch(r"± \d+", sigma)
    assert (unit, truth) == ("N/m", "(2100)")  # steady.toml
    rows = 1 + len(codec.database().messages)
    desktop.wait(f"document.querySelectorAll('#messages tr').length == {rows}")
    desktop.wait("Array.from(document.querySelectorAll('#messages td'), e => Number(e.textContent)).some(n => n > 900)")
    for canvas in ("#magnitude", "#phase", "#coherence", "#magnitude-map", "#bands canvas", "#health canvas"):
        assert drawn(desktop, canvas) > 20, canvas
    terms = "Array.from(document.querySelectorAll('#health dt'), e => [e.textContent, e.nextSibling.textContent])"
    health = dict(desktop.run(terms))
    assert float(health["theta"].removesuffix(" deg")) == pytest.approx(20.0, abs=5.0)
    assert (health["model"], health["choices"]) == ("lever", "trim, dual, robbins_monro, none")
    assert re.fullmatch(r"\d+ lost, \d+ corrupt, \d+ late", health["counts"])
    assert health["firmware"][0].isdigit()

    assert desktop.run("document.querySelector('[data-request=run]').ariaPressed") == "true"
    desktop.click("[data-request=freeze]")
    desktop.wait("document.querySelector('[data-request=freeze]').ariaPressed == 'true'")
    assert desktop.run(CONDITION) == "frozen: states are estimated, parameters held, by command"
    frozen = estimates(desktop)["kp stiffness"][0]
    desktop.run("new Promise(done => setTimeout(done, 500))")
    assert estimates(desktop)["kp stiffness"][0] == frozen
    desktop.click("[data-request=run]")
    desktop.wait("document.querySelector('[data-request=run]').ariaPressed == 'true'")

    desktop.click("[data-request=reset]")
    assert desktop.run("document.querySelector('[data-request=reset]').textContent") == "reset: sure?"
    assert desktop.run("document.getElementById('answer').textContent") == "Sent: request run"
    desktop.click("[data-request=reset]")
    desktop.wait("document.getElementById('answer').textContent == 'Sent: request reset'")
    choose(desktop, "#dither", "0.5")
    desktop.wait("document.getElementById('answer').textContent == 'Sent: dither_rms 0.5'")
    choose(desktop, "#model", "linear_physical")
    desktop.wait("document.querySelector('#estimates td').textContent == 'm mass'")
    assert estimates(desktop)["m mass"][3] == ""  # the pilot is not of this model: no truth

    assert not desktop.run("document.getElementById('useless').checkVisibility()")
    choose(desktop, "#model", "linear_black_box")
    desktop.wait("document.getElementById('useless').checkVisibility()")
    assert desktop.run("Array.from(document.querySelectorAll('#dither option'), e => e.value)") == ["", "0"]

    origins = desktop.run("performance.getEntriesByType('resource').map(e => new URL(e.name).origin)")
    assert set(origins) == {url.rstrip("/")}
    assert desktop.complaints == []
    end(process)


LABELS = """
  const draw = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    if (x == 2 && y == 8) this.canvas.labels = []; // the title, which is drawn first
    const width = this.measureText(text).width, part = {left: 0, center: 0.5, right: 1}[this.textAlign];
    this.canvas.labels.push([text, x - part * width, y - 6, x + (1 - part) * width, y + 6]);
    draw.call(this, text, x, y);
  };
"""


def test_a_scenario_that_starts_over_is_told_and_no_label_lies_on_another(
    browser: Browser, start_lever: Start, tmp_path: Path
) -> None:
    """On a narrow and on a wide page."""
    steady = (resources.files("lever_sil.scenarios") / "steady.toml").read_text()
    (tmp_path / "brief.toml").write_text(re.sub("(?m)^duration = .*$", 'duration = "2 s"', steady))
    process = start_lever("live", "--scenario", str(tmp_path / "brief.toml"), "--port", "0")
    url = address(process)
    for width in (390, 1280):
        browser.begin(width, 844)
        browser.prepare(LABELS)
        browser.open(url)
        browser.wait("document.getElementById('notice').textContent.startsWith('The scenario has started over')")
        assert "simulation of brief, run " in browser.run("document.getElementById('title').textContent")
        for labels in browser.run("Array.from(document.querySelectorAll('canvas'), e => e.labels)"):
            assert len(labels) > 4
            for first, second in itertools.combinations(labels, 2):
                apart = first[3] <= second[1] or second[3] <= first[1] or first[4] <= second[2] or second[4] <= first[2]
                assert apart, (width, first, second)
    end(process)


def test_it_says_that_the_server_is_gone_and_finds_it_again(desktop: Browser, start_lever: Start) -> None:
    process = start_lever("live", "--scenario", "steady", "--port", "0")
    url = address(process)
    desktop.open(url)
    desktop.wait(f"{CONDITION}.startsWith('run')")
    assert not desktop.run("document.body.classList.contains('stale')")
    end(process)
    desktop.wait(f"{CONDITION} == 'The connection to the server is lost; this page keeps trying.'")
    assert desktop.run("document.body.classList.contains('stale')")
    desktop.click("[data-request=freeze]")
    assert desktop.run("document.getElementById('answer').textContent") == "Not sent: there is no connection."
    again = start_lever("live", "--scenario", "steady", "--port", url.rsplit(":", 1)[1].rstrip("/"))
    address(again)
    desktop.wait(f"{CONDITION}.startsWith('run')")
    assert not desktop.run("document.body.classList.contains('stale')")
    end(again)


def test_a_server_that_hangs_is_told(desktop: Browser, start_lever: Start) -> None:
    process = start_lever("live", "--scenario", "steady", "--port", "0")
    desktop.open(address(process))
    desktop.wait(f"{CONDITION}.startsWith('run')")
    process.send_signal(signal.SIGSTOP)
    desktop.wait(f"{CONDITION}.startsWith('No data from the server')")
    assert desktop.run("document.body.classList.contains('stale')")
    process.send_signal(signal.SIGCONT)
    desktop.wait("!document.body.classList.contains('stale')")
    end(process)


def test_before_the_first_frame_and_read_only(desktop: Browser, start_lever: Start, log: Path) -> None:
    """A log of which the first seconds are silent, and nothing of which may be commanded."""
    lines = log.read_text().splitlines(keepends=True)
    late = [line.replace("(0.", "(103.").replace("(0 ", "(103 ") for line in lines]
    log.write_text("(100.000000) can0 123#00 R\n" + "".join(late))
    process = start_lever("live", str(log), "--port", "0")
    desktop.open(address(process))
    desktop.wait(f"{CONDITION} == 'frames pass, but neither samples nor estimates'")
    assert all(cells[0] == "–" for cells in estimates(desktop).values())
    assert desktop.run("document.getElementById('controls').hidden")
    assert not desktop.run("document.getElementById('read-only').hidden")
    assert not desktop.run("document.querySelector('.simulated').checkVisibility()")
    desktop.wait(f"{CONDITION} == 'the end: nothing more will come'")
    assert "mp mass" in estimates(desktop)
    assert desktop.complaints == []
    end(process)


def test_on_a_phone(browser: Browser, start_lever: Start) -> None:
    process = start_lever("live", "--scenario", "steady", "--port", "0")
    background = "getComputedStyle(document.body).backgroundColor"
    browser.begin(390, 844, phone=True)
    browser.open(address(process))
    browser.wait(f"{CONDITION}.startsWith('run')")
    sizes = browser.run("(({scrollWidth, clientWidth}) => [scrollWidth, clientWidth])(document.documentElement)")
    assert sizes == [390, 390]  # nothing to be scrolled sideways
    targets: list[dict[str, Any]] = browser.run(
        "Array.from(document.querySelectorAll('button, select'), e => e.getBoundingClientRect().toJSON())"
    )
    assert all(each["height"] >= 40 and each["right"] <= 390 for each in targets)
    assert browser.run(background) == "rgb(255, 255, 255)"
    browser.darken()
    browser.wait(f"{background} != 'rgb(255, 255, 255)'")
    browser.click("[data-request=freeze]")
    browser.wait(f"{CONDITION}.startsWith('frozen: ')")
    assert browser.complaints == []
    end(process)
