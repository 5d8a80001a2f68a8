"""Off-screen drawing by VTK through EGL: chunks of lines and triangles into one framebuffer.

Colours are linear RGB, kept in 8 bits as their cube root over a range of 0 .. 4, so that dark hair keeps its tones
and highlights do not clip before the samples of a pixel are averaged.
"""

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.errors import InputError
from pipeline.render.view import View

Colours = NDArray[np.float32]
Points = NDArray[np.float32]

BRIGHTEST = 4.0  # linear value that 255 stands for
NOTHING = 2.0  # depth where nothing is drawn
_MARGIN = 1e-3  # [m] between what is drawn and the clipping planes


def encode(colours: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Linear RGB to bytes of the framebuffer."""
    unit = np.clip(np.asarray(colours, np.float32) / np.float32(BRIGHTEST), 0, 1)
    return np.asarray(np.cbrt(unit) * 255 + np.float32(0.5), np.uint8)


DECODED = (BRIGHTEST * (np.arange(256) / 255) ** 3).astype(np.float32)
"""Linear value of each byte of the framebuffer."""


class Target:
    """A framebuffer; `clear`, then draw in any number of pieces, then `read`."""

    def __init__(self, width: int, height: int, background: tuple[float, float, float]) -> None:
        """Open an off-screen window of width x height samples. Raises InputError where EGL has no driver."""
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer

        self.width, self.height = width, height
        self._window = _open_window()
        self._renderer = vtkRenderer()
        self.background_bytes = encode(np.array(background))
        """(3,) uint8: what `read` gives where nothing is drawn."""
        self._renderer.SetBackground(*(self.background_bytes / 255.0).tolist())
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(0)
        self._window.SetSize(width, height)
        self._window.AddRenderer(self._renderer)
        self._mapper = vtkPolyDataMapper()
        self._mapper.SetColorModeToDirectScalars()
        self._mapper.SetScalarModeToUsePointData()
        self._actor = vtkActor()
        self._actor.SetMapper(self._mapper)
        self._actor.GetProperty().LightingOff()
        self._renderer.AddActor(self._actor)
        self._kept: list[Any] = []
        self._pixels: NDArray[np.uint8] | None = None
        self._depths: NDArray[np.float32] | None = None
        self.blank = False
        """Whether there is nothing but the background since `background`."""

    def clear(self, camera: View, near: float, far: float) -> None:
        """Start a picture; what lies between the distances `near` and `far` [m] from the camera is drawn."""
        view = self._renderer.GetActiveCamera()
        view.SetPosition(*camera.position)
        view.SetFocalPoint(*camera.look_at)
        view.SetViewUp(*camera.up)
        view.SetViewAngle(np.degrees(camera.field_of_view))
        half = np.tan(camera.field_of_view / 2)
        view.SetWindowCenter(camera.shift[0] / half * self.height / self.width, camera.shift[1] / half)
        view.SetClippingRange(max(near - _MARGIN, 0.01 * far), far + _MARGIN)
        self.blank = False
        self._renderer.PreserveColorBufferOff()
        self._renderer.PreserveDepthBufferOff()

    def background(self) -> None:
        """Draw nothing but the background, which OpenGL need not do before there is more: it takes much memory."""
        self.blank = True

    def triangles(self, points: Points, triangles: NDArray[np.integer[Any]], colours: Colours) -> None:
        """Draw triangles (T, 3) over points (N, 3) [m] with linear colours (N, 3)."""
        self._draw(self._mesh(points, triangles, encode(colours)))

    def lines(self, points: Points, colours: Colours, drawn: NDArray[np.bool_]) -> None:
        """Draw segments (S, P-1) of strands (S, P, 3) [m] as lines one sample wide."""
        mesh = self._poly_data(points.reshape(-1, 3), encode(colours.reshape(-1, 3)))
        strand, segment = np.nonzero(drawn)
        first = strand * points.shape[1] + segment
        ends = np.stack([first, first + 1], axis=1).reshape(-1)
        mesh.SetLines(self._cells(np.arange(0, len(ends) + 1, 2), ends))
        self._draw(mesh)

    def tubes(
        self,
        points: Points,
        colours: Colours,
        widths: NDArray[np.float32],
        drawn: NDArray[np.bool_],
        sides: int,
    ) -> None:
        """Draw segments (S, P-1) of strands (S, P, 3) [m] as closed tubes of widths (S, P) [m], what faces the eye."""
        view = self._renderer.GetActiveCamera()
        eye, sample = (
            np.array(view.GetPosition()),
            2 * np.tan(np.radians(view.GetViewAngle() / 2)) / self.height,
        )
        corners, triangles = kernels.tubes(points, widths, drawn, sides, eye, sample)
        own = np.repeat(encode(colours).reshape(-1, 3), sides, axis=0)
        self._draw(self._mesh(corners.reshape(-1, 3), triangles, own))

    def read(self) -> NDArray[np.uint8]:
        """The bytes of the framebuffer (H, W, 3), top row first; they are valid until the next call."""
        from vtkmodules.util.numpy_support import numpy_to_vtk

        if self._pixels is None:
            self._pixels = np.empty((self.height, self.width, 3), np.uint8)
        if self.blank:
            self._pixels[:] = self.background_bytes
            return self._pixels
        values = numpy_to_vtk(self._pixels.reshape(-1, 3))
        self._window.GetPixelData(0, 0, self.width - 1, self.height - 1, 0, values, 0)
        kernels.turn_over(self._pixels)
        return self._pixels

    def depth(self) -> NDArray[np.float32]:
        """Depth of the framebuffer (H, W), top row first: 0 at the near plane, 1 at the far one, 2 where nothing is.

        It is valid until the next call.
        """
        from vtkmodules.util.numpy_support import numpy_to_vtk

        if self._depths is None:
            self._depths = np.empty((self.height, self.width), np.float32)
        if self.blank:
            self._depths[:] = NOTHING
            return self._depths
        self._window.GetZbufferData(
            0, 0, self.width - 1, self.height - 1, numpy_to_vtk(self._depths.reshape(-1))
        )
        kernels.turn_over(self._depths)
        self._depths[self._depths >= 1] = NOTHING
        return self._depths

    def matrix(self) -> NDArray[np.float64]:
        """World [m] to clip space (4, 4), of the camera of the last `clear`."""
        aspect = self._renderer.GetTiledAspectRatio()
        matrix = self._renderer.GetActiveCamera().GetCompositeProjectionTransformMatrix(aspect, -1, 1)
        return np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])

    def planes(self) -> tuple[float, float]:
        """Distances [m] of the near and the far plane."""
        near, far = self._renderer.GetActiveCamera().GetClippingRange()
        return float(near), float(far)

    @property
    def renderer_name(self) -> str:
        """Renderer and version strings of OpenGL."""
        lines = [line.strip() for line in str(self._window.ReportCapabilities()).splitlines()]
        wanted = ("OpenGL renderer string", "OpenGL version string")
        found = [line.split(":", 1)[1].strip() for line in lines if line.startswith(wanted)]
        return ", ".join(found)

    def close(self) -> None:
        """Free the window."""
        self._window.Finalize()

    def _draw(self, mesh: Any) -> None:
        self.blank = False
        self._mapper.SetInputData(mesh)
        self._window.Render()
        self._renderer.PreserveColorBufferOn()
        self._renderer.PreserveDepthBufferOn()
        self._kept.clear()

    def _mesh(self, points: Points, triangles: NDArray[np.integer[Any]], encoded: NDArray[np.uint8]) -> Any:
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonDataModel import vtkCellArray

        mesh = self._poly_data(points, encoded)
        corners = np.ascontiguousarray(triangles, np.int32).reshape(-1)
        self._kept.append(corners)
        cells = vtkCellArray()
        cells.SetData(3, numpy_to_vtk(corners))
        mesh.SetPolys(cells)
        return mesh

    def _poly_data(self, points: Points, encoded: NDArray[np.uint8]) -> Any:
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkPolyData

        positions = np.ascontiguousarray(points, np.float32)
        self._kept += [positions, encoded]  # VTK does not copy them
        vertices = vtkPoints()
        vertices.SetData(numpy_to_vtk(positions))
        scalars = numpy_to_vtk(encoded)
        scalars.SetName("colour")
        mesh = vtkPolyData()
        mesh.SetPoints(vertices)
        mesh.GetPointData().SetScalars(scalars)
        return mesh

    def _cells(self, offsets: NDArray[Any], connectivity: NDArray[Any]) -> Any:
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonDataModel import vtkCellArray

        arrays = [np.ascontiguousarray(a, np.int64) for a in (offsets, connectivity)]
        self._kept += arrays
        cells = vtkCellArray()
        cells.SetData(*(numpy_to_vtk(a) for a in arrays))
        return cells


def _open_window() -> Any:
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    # The modules one by one: all of VTK is 80 MB and a third of a second more
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
    from vtkmodules.vtkCommonCore import vtkLogger as log  # noqa: N813
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    shown = log.GetCurrentVerbosityCutoff()
    log.SetStderrVerbosity(log.VERBOSITY_OFF)  # VTK's own words about what is missing name no remedy
    window = vtkRenderWindow()
    log.SetStderrVerbosity(shown)
    if window.GetClassName() != "vtkEGLRenderWindow":
        raise InputError(
            "render: no off-screen OpenGL; install it by: sudo apt-get install -y libegl1 libgl1-mesa-dri"
        )
    return window
