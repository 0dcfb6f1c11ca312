"""Pictures of plans: pixels, SVG and contact sheets."""

from houseexpo.drawing.draw import Image, contact_sheet, draw_plan, encode_drawing, svg, svg_sheet

__all__ = ["Image", "contact_sheet", "draw_plan", "encode_drawing", "svg", "svg_sheet"]
