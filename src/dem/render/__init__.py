"""Pictures of finished runs: images and files for ParaView. Needs no display and no
OpenGL."""

from dem.render.files import export_vtk, read_run
from dem.render.image import draw_run, save_image

__all__ = ["draw_run", "export_vtk", "read_run", "save_image"]
