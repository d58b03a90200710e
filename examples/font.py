"""A font's outlines as a drawing, and a drawing's outlines as a font.

    pip install fonttools
    python examples/font.py draw FONT.ttf glyphs.svg
    faircurve bezier glyphs.svg -o fewer.svg --simplify --tolerance 1 --corners 5
    python examples/font.py set fewer.svg FONT.ttf NEW.otf

The drawing has a path a glyph, in units of the font. The new font has cubic outlines (CFF), and all
else as it was.
"""

import sys
from xml.etree import ElementTree

from fontTools.fontBuilder import FontBuilder
from fontTools.pens.svgPathPen import SVGPathPen
from fontTools.pens.t2CharStringPen import T2CharStringPen
from fontTools.svgLib.path import parse_path
from fontTools.ttLib import TTFont

OUTLINES_AND_THEIR_HINTS = ["glyf", "loca", "CFF ", "fpgm", "prep", "cvt ", "gasp", "hdmx", "LTSH", "VDMX", "DSIG"]


def draw(font_path, svg_path):
    font = TTFont(font_path)
    glyphs = font.getGlyphSet()
    with open(svg_path, "w") as svg:
        svg.write('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 2048 2048">\n')
        for name in font.getGlyphOrder():
            pen = SVGPathPen(glyphs)
            glyphs[name].draw(pen)
            if pen.getCommands():
                svg.write(f'<path id="{name}" d="{pen.getCommands()}"/>\n')
        svg.write("</svg>\n")


def set_outlines(svg_path, font_path, new_path):
    font = TTFont(font_path)
    paths = {path.get("id"): path.get("d") for path in ElementTree.parse(svg_path).getroot()}
    outlines = {}
    for name in font.getGlyphOrder():
        pen = T2CharStringPen(font["hmtx"][name][0], None)
        parse_path(paths.get(name, ""), pen)
        outlines[name] = pen.getCharString()
    for table in OUTLINES_AND_THEIR_HINTS:
        if table in font:
            del font[table]
    font.sfntVersion = "OTTO"
    builder = FontBuilder(font=font)
    builder.setupCFF(font["name"].getDebugName(6), {}, outlines, {})
    font["maxp"].tableVersion = 0x00005000
    font.save(new_path)


if len(sys.argv) == 4 and sys.argv[1] == "draw":
    draw(*sys.argv[2:])
elif len(sys.argv) == 5 and sys.argv[1] == "set":
    set_outlines(*sys.argv[2:])
else:
    sys.exit(__doc__)
