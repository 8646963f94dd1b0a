"""Pictures of finished runs: images, animations and files for ParaView. Needs no display and no
OpenGL."""

from dem.render.animation import animate
from dem.render.export import export_vtk
from dem.render.files import read_run
from dem.render.image import draw_run, save_image

__all__ = ["animate", "draw_run", "export_vtk", "read_run", "save_image"]
