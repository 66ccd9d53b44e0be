"""Makes the seeds of the fuzz targets from the drawings, scenes, fonts and cases of the repository: python3 tests/fuzz/seeds/make.py

Needs fontTools. The letters are cut out of the bundled fonts, under their licences (fonts/README.md), and renamed.
"""

import base64
import io
import json
import pathlib
import struct
import zlib

from fontTools import subset
from fontTools.ttLib import TTFont, newTable

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parent.parent.parent


def put(target, name, data):
    file = HERE / target / name
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(data if isinstance(data, bytes) else data.encode())


def letters(font, text):
    """The font with the glyphs of the text only."""
    options = subset.Options(hinting=False, notdef_outline=True, name_IDs=[], layout_features=["liga", "kern", "mark", "init", "fina", "rlig"],
                             drop_tables=["STAT", "meta", "DSIG", "HVAR", "MVAR", "GDEF", "FFTM", "BASE"], glyph_names=False)
    font = subset.load_font(ROOT / "fonts" / font, options)
    cut = subset.Subsetter(options)
    cut.populate(text=text)
    cut.subset(font)
    font["name"] = newTable("name")
    font["name"].names = []
    font["name"].setName("Letters", 1, 3, 1, 0x409)
    if "fvar" in font:
        font["fvar"].instances = []
        for axis in font["fvar"].axes:
            axis.axisNameID = 1
    file = io.BytesIO()
    font.save(file)
    return file.getvalue()


def text(font, letters_, place=0):
    """An input of the target `font`."""
    data = letters_.encode()
    assert len(data) < 32
    return bytes([len(data), place]) + data + font


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


# Two by two texels: red, half green; blue, white.
PICTURE = (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 2, 8, 6, 0, 0, 0))
           + chunk(b"IDAT", zlib.compress(bytes.fromhex("00ff0000ff00ff0080" "000000ffffffffffff"))) + chunk(b"IEND", b""))

# What the targets `svg` and `scene` have at hand.
put("", "letters.ttf", letters("DejaVuSans.ttf", "abO&"))
put("", "picture.png", PICTURE)

put("font", "glyf", text(letters("DejaVuSans.ttf", "a&"), "a&a"))
put("font", "composite", text(letters("DejaVuSans.ttf", "\u00e9\u00c5"), "\u00e9\n\u00c5"))
put("font", "gvar", text(letters("Inter.var.ttf", "Oa"), "Oa", 200))
put("font", "cff", text(letters("SourceSans3-Regular.otf", "g\u00e9"), "g\u00e9", 1))
put("font", "cff2", text(letters("SourceSans3VF-Upright.otf", "gV"), "Vg", 130))
put("font", "arabic", text(letters("Amiri-Regular.ttf", "\u0644\u0627\u064e"), "\u0644\u064e\u0627"))

for drawing in sorted((ROOT / "svg").glob("*.svg")):
    put("svg", drawing.name, drawing.read_bytes())
put("svg", "text.svg", '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 20"><text x="2" y="15" font-size="14" fill="#fff" '
    'stroke="red" font-family="Letters" rotate="9">ab<tspan fill="#0f0" dy="2">O</tspan></text></svg>')
put("svg", "mask.svg", '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"><mask id="m"><path d="M1 1H8V8z" fill="#fff"/></mask>'
    '<filter id="f"><feGaussianBlur stdDeviation="1"/></filter><g mask="url(#m)" opacity=".5"><circle r="5" fill="red"/></g>'
    '<marker id="k" markerWidth="3" markerHeight="3"><rect width="2" height="2" fill="#fff"/></marker>'
    '<polyline points="1 1 5 5 8 2" stroke="#00f" stroke-linejoin="round" marker-mid="url(#k)" filter="url(#f)"/></svg>')
put("svg", "image.svg", '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><image width="9" height="9" href="data:image/png;base64,'
    + base64.b64encode(PICTURE).decode() + '"/></svg>')

put("path", "arcs", "M1 0A1 1 0 0 1-1 0A1 1 0 0 1 1 0Z")
put("path", "crossing", "M0 0L10 10H0L10 0Z")
put("path", "curves", "m1 2 3 4h5v-6l-1-2c1 2 3 4 5 6s3 4 5 6q1 2 3 4t5 6t1-8z")
put("path", "holes", "M0 0H9V9H0ZM2 2H7V7H2ZM3 3V6H6V3Z")
put("path", "cusp", "M0 0C10 10-5 10 5 0C5-3 0-3 0 0Z")
put("path", "small", "M1e-9 0L2e-9 1e-9L0 1e-9ZM1 1e5")

for folder in ["src/scene/figures", "tests/data/scenes"]:
    for scene in sorted((ROOT / folder).glob("*.toml")):
        toml = scene.read_text()
        for ending, name in [("svg", "a.svg"), ("glb", "a.glb")]:
            toml = "\n".join(line.split('"')[0] + f'"{name}"' if line.split('"')[-2:-1] and line.split('"')[-2].endswith("." + ending) else line
                             for line in toml.split("\n"))
        # Comments teach nothing.
        put("scene", scene.name, "\n".join(line for line in toml.split("\n") if not line.startswith("#")))
put("scene", "bodies.toml", "[camera]\nposition = [0, 1, 5]\nlook_at = [0, 0, 0]\n[[surface]]\nkind = \"plane\"\nsize = 9\n"
    "[[light]]\nshape = \"sphere\"\nradius = 0.5\nposition = [1, 1, 0]\npower = 9\n[[light]]\nshape = \"tube\"\nradius = 0.1\nlength = 2\n"
    "rotation = [10, 20, 30]\n[[light]]\npicture = \"a.png\"\nshape = \"ellipse\"\nsize = [1, 2]\nscale = [-1, 2]\n[[light]]\nshape = \"rectangle\"\nsize = 1\n")
put("scene", "texts.toml", "[camera]\nposition = [0, 1, 5]\nlook_at = [0, 0, 0]\n[[light]]\ntext = \"aO\\nb\"\nfont = [\"a.ttf\"]\nsize = 0.5\n"
    "align = \"right\"\nletter_spacing = 0.1\nline_height = 1.2\ndirection = \"rtl\"\nluminance = 100\ncolor = [1, 0.5, 0]\n")

cases = [json.loads(line) for line in (ROOT / "tests/data/integrals.jsonl").read_text().splitlines()]
for kind in dict.fromkeys(case["id"].rsplit("-", 1)[0] for case in cases):
    fitting = [c for c in cases if c["id"].rsplit("-", 1)[0] == kind]
    case = min(fitting, key=lambda c: len(c["curves"]))
    case.pop("value", None)
    shorter = json.loads(json.dumps(case), parse_float=lambda v: float(f"{float(v):.6g}"))
    if len(case["curves"]) <= 12:
        put("probe", case["id"], json.dumps(shorter, separators=(",", ":")))

MOVE, LINE, QUAD, CUBIC, CLOSE, END, FINE = 0, 1, 3, 4, 6, 7, 8


def code(*parts):
    return b"".join(struct.pack("b", p) for p in parts)


square = code(MOVE, -50, -50, LINE, 50, -50, LINE, 50, 50, LINE, -50, 50, CLOSE)
diamond = code(MOVE, 0, -60, LINE, 60, 0, LINE, 0, 60, LINE, -60, 0, CLOSE)
drop = code(MOVE, 0, 0, CUBIC, 100, 80, -100, 80, 0, 0, CLOSE)
leaf = code(MOVE, 0, 0, QUAD, 40, 0, 40, 40, QUAD, 0, 40, 0, 0)
near = code(MOVE | FINE, -50, 1, -50, 0, LINE | FINE, 50, 0, -50, 0, LINE | FINE, 50, 0, 50, 1, CLOSE)
put("boolean", "square-diamond", code(0) + square + code(END, 0) + diamond)
put("boolean", "drop-square", code(3) + drop + square + code(END, 3) + drop)
put("boolean", "leaf-near", code(-9) + leaf + near + code(END, -9) + square)
put("boolean", "twice", code(0) + square + square + code(END, 0) + square)
