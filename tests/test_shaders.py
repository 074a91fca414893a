"""GLSL sources: includes, line origins, records."""

import ctypes

import numpy as np
import pytest

from defshade_cli.errors import ShaderError
from defshade_cli.gpu.context import LIBEGL, Gpu
from defshade_cli.gpu.records import record, record_of
from defshade_cli.gpu.shaders import assemble
from defshade_cli.resources import SHADERS


def test_an_include_is_pasted_once() -> None:
    text = assemble("gbuffer.frag", generated={"generated/planes.glsl": "", "generated/textures.glsl": ""}).text
    assert text.count("struct View {") == 1
    assert text.count("const float PI") == 1


def test_every_line_knows_its_file() -> None:
    source = assemble("main.frag", generated={"main.frag": '#include "part.glsl"\nx;', "part.glsl": "a;\nb;"})
    assert source.text.splitlines() == ["#version 450 core", "a;", "b;", "x;"]
    assert source.name == "main.frag"
    assert source.locate("0:3(7): error: b") == "part.glsl:2: error: b"
    assert source.locate("0(4) : error C0000: x") == "main.frag:2: error C0000: x"


def test_a_missing_include_is_named() -> None:
    with pytest.raises(ShaderError, match=r"lib/none\.glsl: no such shader"):
        assemble("main.frag", generated={"main.frag": '#include "lib/none.glsl"'})


def test_a_compile_error_reads_as_file_and_line(gpu: Gpu) -> None:
    generated = {
        "broken.frag": '#include "bad.glsl"\nvoid main() {}\n',
        "bad.glsl": "float fine() { return 1.0; }\nfloat bad() { return nothing; }\n",
    }
    with pytest.raises(ShaderError, match=r"bad\.glsl:2:.*nothing"):
        gpu.shaders.program("screen.vert", "broken.frag", generated=generated)


def test_a_program_is_compiled_once(gpu: Gpu) -> None:
    assert gpu.shaders.program("screen.vert", "accumulate.frag") is gpu.shaders.program(
        "screen.vert", "accumulate.frag"
    )


def test_std430_packs_a_scalar_behind_a_vec3() -> None:
    dtype = record_of("vec3 a; float b; vec2 c; uint d; mat4 e;")
    assert [dtype.fields[name][1] for name in dtype.names] == [0, 12, 16, 24, 32]
    assert dtype.itemsize == 96


def test_records_reach_the_gpu_as_they_were_written(gpu: Gpu) -> None:
    """Every member of Light, read back by a shader that uses the same struct."""
    light = np.zeros(2, record("Light"))
    light["position"], light["reach"] = [[1, 2, 3], [4, 5, 6]], [7, 8]
    light["focus_tint"], light["profile"], light["response"] = (
        [[0.1, 0.2, 0.3]] * 2,
        [1, 2],
        [[9, 10], [11, 12]],
    )
    body = """
    #include "lib/records.glsl"
    layout(local_size_x = 1) in;
    layout(std430, binding = 0) readonly buffer Lights { Light lights[]; };
    layout(std430, binding = 1) writeonly buffer Values { float values[]; };
    void main() {
        Light l = lights[1];
        float found[8] = float[8](l.position.x, l.position.z, l.reach, l.focus_tint.y, float(l.profile),
                                  l.response.x, l.response.y, float(lights.length()));
        for (int i = 0; i < 8; ++i) values[i] = found[i];
    }"""
    program = gpu.shaders.compute("read.comp", generated={"read.comp": body})
    source, values = gpu.context.buffer(light.tobytes()), gpu.context.buffer(reserve=32)
    source.bind_to_storage_buffer(0)
    values.bind_to_storage_buffer(1)
    program.run(1)
    np.testing.assert_allclose(np.frombuffer(values.read(), np.float32), [4, 6, 8, 0.2, 2, 11, 12, 2], rtol=1e-7)


def test_contexts_keep_to_themselves(gpu: Gpu) -> None:
    """Another context is opened, used, and closed while a third is current: this one's buffers stay what they were."""
    mine = gpu.context.buffer(b"mine")
    second = Gpu()
    second.keep(second.context.buffer(b"them"))
    third = Gpu()
    second.close()
    third.close()
    gpu.make_current()
    assert mine.read() == b"mine"


def test_a_closed_context_is_gone(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """EGL only marks one that is current; it would live on, with what it drew last, until the process ends."""
    with monkeypatch.context() as patch:
        patch.setattr(Gpu, "_open", [])
        Gpu().close()
        current = ctypes.CDLL(LIBEGL).eglGetCurrentContext
        current.restype = ctypes.c_void_p
        assert current() is None
    gpu.make_current()


def test_libraries_hold_no_main_and_entry_points_do() -> None:
    for path in SHADERS.rglob("*.*"):
        if path.suffix in (".vert", ".frag", ".comp", ".glsl"):
            assert ("void main()" in path.read_text()) == (path.suffix != ".glsl"), path.name
