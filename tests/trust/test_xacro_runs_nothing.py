"""xacros that are programs: each expression was written to get out, none does."""

import subprocess
import sys
from pathlib import Path

import pytest

from excite_cli.errors import RobotError
from excite_cli.robot.description import load_description
from excite_cli.robot.formats.xacro_expression import evaluate, symbols
from tests.cli.program import EXCITE
from tests.trust.conftest import XACRO

U = "'_'*2"  # two underscores, which a search for them does not see
# The attribute `name` of a value, without a dot: by the descriptors of its type.
OF = (
    f"(lambda f, n: (lambda d: python.vars(python.type(d))[{U}+'get'+{U}](d, f))"
    "(python.vars(python.type(f))[n]))"
)
GLOBALS = f"{OF}(xacro.load_yaml, {U}+'globals'+{U})"
RUN = "system('touch written')"
BASE = f"python.vars(python.type)[{U}+'getattribute'+{U}](python.str, {U}+'base'+{U})"
SUBCLASSES = f"python.vars(python.type)[{U}+'subclasses'+{U}]({BASE})"

TABLE = symbols({"load_yaml": dict, "abs_filename": str, "dotify": dict})

PROGRAMS = {
    "globals of a function": f"{GLOBALS}['os'].{RUN}",
    "globals of a print function": (f"{OF}(xacro.warning, {U}+'globals'+{U})['os'].{RUN}"),
    "builtins of a function": (f"{GLOBALS}[{U}+'builtins'+{U}][{U}+'import'+{U}]('os').{RUN}"),
    "builtins that open": f"{GLOBALS}[{U}+'builtins'+{U}]['open']('written', 'w')",
    "another eval": (f"{GLOBALS}[{U}+'builtins'+{U}]['eval']('open(\"written\", \"w\")')"),
    "modules of sys": f"{GLOBALS}['sys'].modules['os'].{RUN}",
    "modules of the yaml reader": (f"{OF}(xacro.tokenize, {U}+'globals'+{U})['glob'].os.{RUN}"),
    "subclasses of object": (
        f"[python.vars(python.type)[{U}+'getattribute'+{U}](c, {U}+'init'+{U}) "
        f"for c in {SUBCLASSES} if '_wrap_close' in str(c)][0]"
        f"({OF}, 'touch written')"
    ),
    "a class with a method": (
        f"python.type('X', (), dict([({U}+'del'+{U}, lambda s: {GLOBALS}['os'].{RUN})]))()"
    ),
    "a lambda": f"(lambda: {GLOBALS}['os'].{RUN})()",
    "a method by sorting": (f"sorted(['touch written'], key={GLOBALS}['os'].system)"),
    "a method by map": f"list(map({GLOBALS}['os'].system, ['touch written']))",
    "a process of subprocess": (
        f"[c for c in {SUBCLASSES} if str(c).find('Popen') > 0][0](['touch', 'written'])"
    ),
    "open": "open('written', 'w')",
    "import": "__import__('os').system('touch written')",
    "dunder": "().__class__.__base__.__subclasses__()",
    "frames": "[x for x in (1,)].gi_frame.f_back.f_globals",
    "a format string": "'{0.__class__.__init__.__globals__}'.format(xacro.load_yaml)",
    "a walrus": "(os := xacro.load_yaml)",
    "starred": "list(*[xacro.load_yaml.__globals__])",
    "a table of a module": "python.vars(math)",
    "types": "python.type(1)",
    "an attribute of text": "'a'.encode",
    "an attribute of a function": "len.real",
    "names of the table": "xacro.update(load_yaml=1)",
    "memory by power": "10**10**8",
    "memory by text": "'a' * 10**10",
    "memory by format": "'%1000000000d' % 1",
    "time by range": "[1 for a in range(100000) for b in range(100000)]",
}


def escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")


def refused(path: Path, text: str) -> None:
    """Such a file is not read, and wrote nothing beside itself."""
    path.write_text(text)
    with pytest.raises(RobotError, match="nothing in a robot's file is run"):
        load_description(str(path))
    assert not (path.parent / "written").exists()


def of(folder: Path) -> str:
    """A program that would write in the folder."""
    return f"(lambda: {GLOBALS}['os'].system('touch {folder}/written'))()"


@pytest.mark.parametrize("program", PROGRAMS.values(), ids=PROGRAMS)
def test_an_expression_runs_nothing(
    program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match="nothing in a robot's file is run"):
        evaluate(program, TABLE, TABLE)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["b'a'", "1j", "...", "module", "[module][0]", "stranger('x')"])
def test_no_value_of_another_kind_comes_in(text: str) -> None:
    """Whatever the library may put among its symbols, only plain data and listed functions pass."""
    names = {**TABLE, "module": sys, "stranger": print}
    with pytest.raises(ValueError, match="a value of type"):
        evaluate(text, names, TABLE)


# Ways to an expression: attributes, text, arguments of macros, `eval`, included files, tables.
WAYS = {
    "property": '<xacro:property name="p" value="${{{0}}}"/><a b="${{p}}"/>',
    "eager property": '<xacro:property name="p" value="${{{0}}}" lazy_eval="false"/>',
    "argument": '<xacro:arg name="p" default="${{{0}}}"/>',
    "condition": '<xacro:if value="${{{0}}}"/>',
    "macro": '<xacro:macro name="m" params="p:=${{{0}}}"/><xacro:m/>',
    "text": "<gazebo>${{{0}}}</gazebo>",
    "element": '<xacro:element xacro:name="${{{0}}}"/>',
    "include": '<xacro:include filename="${{{0}}}"/>',
}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_no_way_to_an_expression_runs_it(way: str, tmp_path: Path) -> None:
    more = way.format(escaped(of(tmp_path)))
    refused(tmp_path / "arm.xacro", XACRO.format(mass=1, more=more))


def test_eval_and_units_of_tables_run_nothing(tmp_path: Path) -> None:
    (tmp_path / "t.yaml").write_text(f'a: !degrees "[{of(tmp_path)} for x in [1]]"\n')
    for mass in ("$(eval find.__globals__['os'])", "${xacro.load_yaml('t.yaml')['a']}"):
        refused(tmp_path / "arm.xacro", XACRO.format(mass=escaped(mass), more=""))


def test_a_urdf_that_is_a_xacro_runs_nothing(tmp_path: Path) -> None:
    program = f"${{{escaped(of(tmp_path))}}}"
    (tmp_path / "arm.xacro").write_text(XACRO.format(mass=program, more=""))
    path = tmp_path / "arm.urdf"
    refused(path, '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="a">'
                  '<xacro:include filename="arm.xacro"/></robot>')  # fmt: skip
    run = subprocess.run([*EXCITE, "robots", path], capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert "nothing in a robot's file is run" in " ".join(run.stderr.split())
    assert not (tmp_path / "written").exists()


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2 * pi / 180", 2 * 3.141592653589793 / 180),
        ("-(3 - 1) ** 2 // 3 % 5", -(2**2) // 3 % 5),
        ("'left_' + str(1) if 1 < 2 <= 2 and not False else 'b'", "left_1"),
        ("[float(x) for x in '1 2 3'.split()][1:]", [2.0, 3.0]),
        ("python.sum([a * b for a, b in python.zip([1, 2], (3, 4)) if a > 1])", 8),
        ("python.sum(range(4)) + math.floor(2.5) + len('abc')", 11),
        ("d['a'].b + d.a['b'] + d.get('c', 1)", 5),
        ("max(list(map(int, ['1', '7'])))", 7),
        ("'%s_%02d' % ('arm', 3)", "arm_03"),
        ("sorted(d.keys())[0]", "a"),
        ("'x' in ['x'] or undefined", True),
        ("python.isinstance('a', str)", True),
        ("round(radians(90), 3)", 1.571),
        ("xacro.abs_filename('a.b')", "a.b"),
    ],
)
def test_what_descriptions_compute_is_computed(text: str, value: object) -> None:
    assert evaluate(text, {**TABLE, "d": {"a": {"b": 2}}}, TABLE) == value
