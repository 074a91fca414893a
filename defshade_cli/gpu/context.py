"""A headless OpenGL context through EGL.

Clip space is set once for the whole context: origin at the upper left, so that row 0 of every target is the top
of the image, and depth in [0, 1], which reversed-Z needs. moderngl has no glClipControl and no 32-bit float depth
texture; both are reached through eglGetProcAddress.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from types import TracebackType
from typing import Any, ClassVar, Self, TypeVar

import moderngl

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import GpuError, GpuMemoryError
from defshade_cli.gpu.shaders import ShaderLibrary

INSTALL_HINT = "apt-get install --no-install-recommends libegl1 libgl1 libgl1-mesa-dri"
LIBGL = os.environ.get("DEFSHADE_LIBGL", "libGL.so.1")
LIBEGL = os.environ.get("DEFSHADE_LIBEGL", "libEGL.so.1")

_REQUIRED_VERSION = 450
_UPPER_LEFT, _ZERO_TO_ONE = 0x8CA2, 0x935F
_TEXTURE_2D, _DEPTH_COMPONENT, _DEPTH_COMPONENT32F, _FLOAT = 0x0DE1, 0x1902, 0x8CAC, 0x1406
_TEXTURE_2D_ARRAY, _SRGB8_ALPHA8, _RGBA, _UNSIGNED_BYTE = 0x8C1A, 0x8C43, 0x1908, 0x1401
_COLOR, _ZEROS = 0x1800, (ctypes.c_uint * 4)()
DEPTH_CLAMP = 0x864F
_NO_ERROR, _OUT_OF_MEMORY = "GL_NO_ERROR", "GL_OUT_OF_MEMORY"

Releasable = TypeVar("Releasable", bound=Any)


class Gpu:
    """One context and everything made in it; a context manager.

    Raises GpuError where there is no EGL, no such device, or a driver below OpenGL 4.5.
    """

    _open: ClassVar[list[Gpu]] = []

    def __init__(self, device: int | None = None) -> None:
        self.context = _create_context(device)
        self._stack = ExitStack()
        self._open.append(self)
        if self.context.version_code < _REQUIRED_VERSION:
            self.close()
            raise GpuError(f"OpenGL 4.5 is needed; this driver has {self.context.version_code / 100:.1f}")
        self._get_address = _egl_get_proc_address()
        self._entry_point("glClipControl", ctypes.c_uint, ctypes.c_uint)(_UPPER_LEFT, _ZERO_TO_ONE)
        self.shaders = ShaderLibrary(self.context)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def make_current(self) -> None:
        """Let GL calls reach this context; the newest one is current until then."""
        self.context.__enter__()

    def close(self) -> None:
        """Release all that was kept, in this context whichever is current, and hand on to the newest one open.

        Draws end before what they read is gone, and the context is let go of first: EGL would keep one that is current,
        with its threads, until the process ends.
        """
        self.make_current()
        self.context.finish()
        self._stack.close()
        self.context.__exit__(None, None, None)
        self.context.release()
        self._open.remove(self)
        if self._open:
            self._open[-1].make_current()

    @property
    def renderer(self) -> str:
        """The driver's own name for the device."""
        return str(self.context.info["GL_RENDERER"])

    @property
    def is_software(self) -> bool:
        """Whether the processor draws."""
        return "llvmpipe" in self.renderer

    @property
    def max_size(self) -> int:
        """Largest width or height of a target, pixels."""
        return int(self.context.info["GL_MAX_TEXTURE_SIZE"])

    @property
    def max_uniform_bytes(self) -> int:
        """Of one uniform block."""
        return int(self.context.info["GL_MAX_UNIFORM_BLOCK_SIZE"])

    @contextmanager
    def watched(self) -> Iterator[None]:
        """What the driver fails at in the block is raised: GL itself goes on without a word, and the image is wrong.

        Raises GpuMemoryError where memory ends, else GpuError.
        """
        self.make_current()
        _ = self.context.error  # of what came before
        try:
            yield
        except moderngl.Error as error:
            raise _failure(self.context.error, str(error)) from error
        if (told := self.context.error) != _NO_ERROR:
            raise _failure(told, told)

    def keep(self, resource: Releasable) -> Releasable:
        """Release `resource` when this Gpu closes."""
        self._stack.callback(resource.release)
        return resource

    def depth_texture(self, size: tuple[int, int]) -> moderngl.Texture:
        """A 32-bit float depth texture of (width, height), sampled without comparison.

        moderngl allocates 24-bit integer depth; the storage is specified anew under the same name.
        """
        texture = self.context.depth_texture(size)
        bind = self._entry_point("glBindTexture", ctypes.c_uint, ctypes.c_uint)
        specify = self._entry_point(
            "glTexImage2D", *[ctypes.c_uint] * 2, *[ctypes.c_int] * 4, *[ctypes.c_uint] * 2, ctypes.c_void_p
        )
        bind(_TEXTURE_2D, texture.glo)
        specify(_TEXTURE_2D, 0, _DEPTH_COMPONENT32F, *size, 0, _DEPTH_COMPONENT, _FLOAT, None)
        texture.compare_func = ""
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def texture_array(
        self, size: tuple[int, int, int], components: int, dtype: str, *, srgb: bool = False
    ) -> moderngl.TextureArray:
        """An empty texture array of (width, height, layers); srgb: of 8-bit RGBA, decoded as it is sampled.

        moderngl knows no sRGB arrays; the storage is specified anew under the same name. Raises GpuError where memory
        ends.
        """
        try:
            array = self.context.texture_array(size, components, dtype=dtype)
        except moderngl.Error as error:
            raise GpuError(f"no room for {size[2]} textures of {size[0]}x{size[1]}: {error}") from error
        if srgb:
            bind = self._entry_point("glBindTexture", ctypes.c_uint, ctypes.c_uint)
            specify = self._entry_point(
                "glTexImage3D", *[ctypes.c_uint] * 2, *[ctypes.c_int] * 5, *[ctypes.c_uint] * 2, ctypes.c_void_p
            )
            bind(_TEXTURE_2D_ARRAY, array.glo)
            specify(_TEXTURE_2D_ARRAY, 0, _SRGB8_ALPHA8, *size, 0, _RGBA, _UNSIGNED_BYTE, None)
        return array

    def clear_integers(self, attachment: int) -> None:
        """Zero a colour attachment of unsigned integers of the bound framebuffer: glClear leaves such undefined."""
        clear = self._entry_point("glClearBufferuiv", ctypes.c_uint, ctypes.c_int, ctypes.c_void_p)
        clear(_COLOR, attachment, ctypes.addressof(_ZEROS))

    def _entry_point(self, name: str, *arguments: Any) -> Callable[..., None]:
        address = self._get_address(name.encode())
        if not address:
            raise GpuError(f"the driver of {self.renderer} lacks {name}")
        return ctypes.CFUNCTYPE(None, *arguments)(address)


@dataclass(frozen=True, slots=True)
class Device:
    """One EGL device as `defshade doctor` lists it."""

    index: int
    vendor: str
    renderer: str
    version: str
    ok: bool
    problem: str = ""


def describe_devices(limit: int = 16) -> list[Device]:
    """Every EGL device in order of its index, at most `limit`; one entry that says why where there is none."""
    devices: list[Device] = []
    for index in range(limit):
        try:
            with Gpu(index) as gpu:
                info = gpu.context.info
                devices.append(Device(index, info["GL_VENDOR"], info["GL_RENDERER"], info["GL_VERSION"], True))
        except GpuError as error:
            if not devices:
                devices.append(Device(index, "", "", "", False, str(error)))
            break
    return devices


def _failure(code: str, reason: str) -> GpuError:
    if code == _OUT_OF_MEMORY:
        return GpuMemoryError(f"no memory is left on the device ({reason})")
    return GpuError(f"the driver failed ({reason})")


def _create_context(device: int | None) -> moderngl.Context:
    options: dict[str, Any] = {"backend": "egl", "libgl": LIBGL, "libegl": LIBEGL}
    if device is not None:
        options["device_index"] = device
    try:
        return moderngl.create_context(standalone=True, **options)
    except Exception as error:  # glcontext raises bare Exception, ValueError or ImportError by case
        reason = str(error).rstrip(".")
        if "device index" in reason and "found 0" not in reason:
            raise GpuError(f"no device {device} ({reason}); `defshade doctor` lists those there are") from error
        raise GpuError(f"no OpenGL context through EGL ({reason}); on Debian or Ubuntu: {INSTALL_HINT}") from error


def _egl_get_proc_address() -> Callable[[bytes], int | None]:
    function = ctypes.CDLL(LIBEGL).eglGetProcAddress
    function.restype, function.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    return function
