#!/usr/bin/env python3
"""Every kind of picture and a report in a browser without a screen: what is really drawn, with the letters that it really has.

Builds the program itself. In a page with all pictures and in each report, light, dark and narrow, no two texts may lie on each
other or leave their picture, every text has to stand out from its ground, and nothing may be asked of a network. Each is also
drawn into a PNG, which must not be empty, and printed into a PDF.

    servowire/tests/browser.py [FOLDER]     the pictures, reports, PNGs and PDFs stay in FOLDER
"""

import json
import re
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

from tool import ROOT, built

CAPTURES = ROOT / "servowire-decode/captures"
BROWSER = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--disable-dev-shm-usage"]
# Of the elements that a picture has.
MEASURE = """
<script>
const told = { overlaps: [], outside: [], pale: [], texts: 0, asked: [], wide: 0 };
const rgb = (text) => (text.match(/[\\d.]+/g) || [0, 0, 0]).map(Number);
const light = (text) => {
  const part = (v) => { v /= 255; return v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; };
  const [r, g, b] = rgb(text).map(part);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const contrast = (a, b) => { const [x, y] = [light(a), light(b)].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05); };
const meet = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1.5
  && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 3.5;
const compare = (boxes, where) => {
  boxes.sort((a, b) => a.box.top - b.box.top);
  for (let i = 0; i < boxes.length; i += 1) {
    for (let j = i + 1; j < boxes.length && boxes[j].box.top < boxes[i].box.bottom; j += 1) {
      if (meet(boxes[i].box, boxes[j].box)) told.overlaps.push([where, boxes[i].text, boxes[j].text]);
    }
  }
};
for (const svg of document.querySelectorAll('svg')) {
  const name = svg.parentElement.id || 'a picture';
  const frame = svg.getBoundingClientRect();
  const ground = getComputedStyle(svg.querySelector('rect')).fill;
  const boxes = [...svg.querySelectorAll('text')].map((it) => ({ text: it.textContent.trim(), box: it.getBoundingClientRect(), it }));
  told.texts += boxes.length;
  for (const { text, box, it } of boxes) {
    if (box.left < frame.left - 0.5 || box.right > frame.right + 0.5 || box.top < frame.top - 0.5 || box.bottom > frame.bottom + 0.5) {
      told.outside.push([name, text]);
    }
    const ratio = contrast(getComputedStyle(it).fill, ground);
    if (ratio < 4.5) told.pale.push([name, text, ratio]);
  }
  compare(boxes, name);
}
const boxes = [];
const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walk.nextNode()) {
  const node = walk.currentNode;
  if (!node.textContent.trim() || node.parentElement.closest('svg, script, style, pre')) continue;
  const range = document.createRange();
  range.selectNodeContents(node);
  const ground = getComputedStyle(document.body).backgroundColor;
  const ratio = contrast(getComputedStyle(node.parentElement).color, ground);
  if (ratio < 4.5) told.pale.push(['page', node.textContent, ratio]);
  for (const box of range.getClientRects()) boxes.push({ text: node.textContent.trim().slice(0, 40), box });
}
compare(boxes, 'page');
told.wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
told.asked = [...document.querySelectorAll('[src], link, object, iframe, image, use')].map((it) => it.outerHTML.slice(0, 80))
  .concat(performance.getEntriesByType('resource').map((it) => it.name));
const out = document.createElement('pre');
out.id = 'told';
out.textContent = JSON.stringify(told);
document.body.append(out);
</script>
"""


def browse(options: list[str], page: Path) -> str:
    """What the browser says of a page."""
    run = subprocess.run([*BROWSER, *options, page.as_uri()], capture_output=True, text=True, timeout=120)
    if run.returncode != 0:
        sys.exit(f"{' '.join(options)} {page}: exit code {run.returncode}\n{run.stderr}")
    return run.stdout


def theme(dark: bool) -> list[str]:
    """0 is the dark one."""
    return [f"--blink-settings=preferredColorScheme={0 if dark else 1}"]


def damaged(folder: Path) -> list[Path]:
    """Captures in which something is wrong: of two encoders on a bus, of a link, and of nobody who answers."""
    made = []
    for name, times in [("hpm-sei-master-log.vcd", 3), ("nikon-hpm-sei-log.vcd", 4), ("hdsl-fw-startup.vcd", 9)]:
        lines = (CAPTURES / name).read_text().splitlines()
        stamps = [at for at, line in enumerate(lines) if line.startswith("#")]
        # Edges are left out here and there, so that bits are others.
        for at in range(len(stamps) // 3, len(stamps) - 2, max(1, len(stamps) // (2 * times))):
            lines[stamps[at] + 1] = lines[stamps[at] + 1].translate(str.maketrans("01", "10"))
        path = folder / f"damaged-{name}"
        path.write_text("\n".join(lines) + "\n")
        made.append(path)
    return made


def drawn(tool: str, folder: Path) -> tuple[list[Path], list[Path]]:
    """One picture of each kind, and reports."""
    captures = sorted(CAPTURES.glob("*.vcd")) + damaged(folder)
    pictures, reports = [], []

    def draw(name: str, *arguments: str) -> None:
        path = folder / f"{name}.svg"
        run = subprocess.run([tool, *arguments, "--svg", str(path)], capture_output=True, text=True)
        if not path.exists() or run.returncode not in (0, 1):
            sys.exit(f"{' '.join(arguments)}: exit code {run.returncode}, no picture\n{run.stderr}")
        pictures.append(path)

    for capture in captures:
        draw(f"decode-{capture.stem}", "decode", str(capture))
        report = folder / f"report-{capture.stem}.html"
        subprocess.run([tool, "report", str(capture), "-o", str(report)], capture_output=True, check=False)
        reports.append(report)
        listed = subprocess.run([tool, "decode", "--json", str(capture)], capture_output=True, text=True).stdout.splitlines()
        events = [json.loads(line) for line in listed]
        wrong = [event for event in events if event["verdict"] not in ("ok", "no_response", "truncated")]
        for event in [events[len(events) // 2], *wrong[:1]]:
            draw(f"explain-{capture.stem}-{event['verdict']}", "explain", str(capture), "--at", f"{event['start_ps']}ps")
    draw("timing-tformat", "timing", "tformat")
    draw("timing-nikon", "timing", "nikon")
    draw("profile", "profile", "--freq", "94570", "--steps", "51200")
    draw("profile-compare", "profile", "--freq", "20000", "--steps", "20000", "--accel", "200000", "--compare")
    draw("profile-gcode", "profile", "--gcode", str(ROOT / "servowire/tests/cmd/gcode.in/plate.nc"))
    draw("cnc", "cnc", "--steps", "2000")
    draw("cnc-scaling", "cnc", "--scaling")
    return pictures, reports


def measured(page: Path, options: list[str]) -> dict:
    """What the script in a page has found."""
    told = re.search(r'<pre id="told">(.*?)</pre>', browse([*options, "--dump-dom"], page), re.S)
    if told is None:
        sys.exit(f"{page}: the browser has not run its script")
    return json.loads(told.group(1).replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))


def faults(told: dict, name: str) -> list[str]:
    """What must not be."""
    found = [f"{name}: {kind}: {one}" for kind in ("overlaps", "outside", "pale", "asked") for one in told[kind]]
    return found + ([f"{name}: {told['wide']} pixels wider than its window"] if told["wide"] > 0 else [])


def foreign(path: Path) -> list[str]:
    """Addresses in a file beside the name of SVG itself."""
    text = path.read_text().replace('xmlns="http://www.w3.org/2000/svg"', "")
    return [f"{path.name}: {one}" for one in re.findall(r'(?:https?:|//[a-z]|@import|url\(|<script|<link|src=)[^\s"<]*', text)]


def colours(png: Path) -> int:
    """How many different lines of pixels a PNG has."""
    data, at, packed, size = png.read_bytes(), 8, b"", (0, 0)
    while at < len(data):
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        if kind == b"IHDR":
            size = (int.from_bytes(data[at + 8 : at + 12], "big"), int.from_bytes(data[at + 12 : at + 16], "big"))
        if kind == b"IDAT":
            packed += data[at + 8 : at + 8 + length]
        at += length + 12
    rows = zlib.decompress(packed)
    wide = len(rows) // size[1]
    return len({rows[k * wide : (k + 1) * wide] for k in range(size[1])})


BAD = """<!DOCTYPE html><meta charset="utf-8"><body style="background: #fff; color: #000"><img src="missing.png">
<div id="bad"><svg width="300" height="100" xmlns="http://www.w3.org/2000/svg"><rect width="300" height="100" fill="#FFFFFF"/>
<text x="10" y="50">one on</text><text x="30" y="52">another</text><text x="290" y="20">outside</text>
<text x="10" y="90" fill="#DDDDDD">pale</text></svg></div><p style="width: 5000px">wide</p>"""


def self_test(folder: Path) -> None:
    """A page that has every fault has to be told apart."""
    page = folder / "bad.html"
    page.write_text(BAD + MEASURE)
    told = measured(page, [*theme(False), "--window-size=1200,800"])
    page.unlink()
    missed = [kind for kind in ("overlaps", "outside", "pale", "asked", "wide") if not told[kind]]
    if missed or len(told["overlaps"]) != 1 or len(told["outside"]) != 1:
        sys.exit(f"the check does not see {missed}: {told}")


def main() -> None:
    keep = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    with tempfile.TemporaryDirectory() as temporary:
        folder = (keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        self_test(folder)
        pictures, reports = drawn(built(), folder)
        found = [one for path in [*pictures, *reports] for one in foreign(path)]
        together = folder / "pictures.html"
        figures = "".join(f'<div id="{path.stem}">{path.read_text()}</div>\n' for path in pictures)
        together.write_text(f'<!DOCTYPE html><meta charset="utf-8"><meta name="color-scheme" content="light dark"><body>{figures}{MEASURE}')
        texts = 0
        for dark in (False, True):
            told = measured(together, [*theme(dark), "--window-size=4200,2000"])
            texts += told["texts"]
            # Frames with many bits are wider than a window.
            found += faults({**told, "wide": 0}, "dark" if dark else "light")
        for report in reports:
            page = folder / f"{report.stem}-measured.html"
            page.write_text(report.read_text().replace("</body>", f"{MEASURE}</body>"))
            for dark, wide in [(False, 1200), (True, 1200), (False, 500)]:
                found += faults(measured(page, [*theme(dark), f"--window-size={wide},2000"]), f"{report.stem} {wide} {dark}")
            page.unlink()
            pdf = report.with_suffix(".pdf")
            browse(["--no-pdf-header-footer", f"--print-to-pdf={pdf}"], report)
            pages = len(re.findall(rb"/Type\s*/Page\b", pdf.read_bytes()))
            if pages == 0:
                found.append(f"{report.name}: nothing is printed")
        for path in [*pictures, *reports]:
            # Both themes of what somebody looks at; the gate takes one of each kind.
            for dark in (False, True) if keep or path in (pictures[0], reports[0]) else (False,):
                png = path.with_name(f"{path.stem}{'-dark' if dark else ''}.png")
                size = re.search(r'<svg width="(\d+)" height="(\d+)"', path.read_text()) if path.suffix == ".svg" else None
                window = f"--window-size={size.group(1)},{size.group(2)}" if size else "--window-size=1100,3000"
                browse([*theme(dark), window, f"--screenshot={png}"], path)
                if colours(png) < 20:
                    found.append(f"{png.name} is empty")
        if found:
            sys.exit("\n".join(found))
        print(f"browser: {len(pictures)} pictures with {texts // 2} texts, {len(reports)} reports: nothing covers anything")


if __name__ == "__main__":
    main()
