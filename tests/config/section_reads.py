"""Which keys of the configuration the program reads, found in its source.

Names are followed from where their type is stated (arguments, fields of classes, what a function
returns) through assignments, loops and attributes; a read is an attribute of a section outside the
package that checks the file. What is not followed counts as not read.
"""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from excite_cli.config.section import Section, _sections_in

Sections = frozenset[type[Section]]
NONE: Sections = frozenset()


def sections_of(top: type[Section]) -> dict[str, type[Section]]:
    """All sections below `top`, by name."""
    found = {top.__name__: top}
    for field in top.model_fields.values():
        for inner in _sections_in(field.annotation):
            if inner.__name__ not in found:
                found |= sections_of(inner)
    return found


class Reads:
    """Reads (section, key) in the modules of a package outside its own `config`."""

    def __init__(self, package: Path, known: dict[str, type[Section]]) -> None:
        self.known = known
        self.found: set[tuple[str, str]] = set()
        self.fields: dict[str, Sections] = defaultdict(frozenset)
        self.returned: dict[str, Sections] = defaultdict(frozenset)
        paths = sorted(package.rglob("*.py"))
        trees = [(path, ast.parse(path.read_text(encoding="utf-8"))) for path in paths]
        for _, tree in trees:
            for node in ast.walk(tree):
                if isinstance(node, ast.FunctionDef) and node.returns is not None:
                    self.returned[node.name] |= self.stated(node.returns)
                elif isinstance(node, ast.ClassDef):
                    for one in node.body:
                        if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name):
                            self.fields[one.target.id] |= self.stated(one.annotation)
        for path, tree in trees:
            if path.relative_to(package).parts[0] != "config":
                self.follow(tree, {})

    def stated(self, annotation: ast.expr) -> Sections:
        """The sections that an annotation names."""
        words = re.findall(r"\w+", ast.unparse(annotation))
        return frozenset(self.known[word] for word in words if word in self.known)

    def follow(self, scope: ast.AST, names: dict[str, Sections]) -> None:
        """Everything in a scope, twice: what is assigned later may be used in a loop before."""
        inside = list(_own_nodes(scope))
        for _ in range(2):
            for node in inside:
                self.learn(node, names)
        for node in inside:
            if isinstance(node, ast.Attribute):
                self.type_of(node, names)
            elif isinstance(node, ast.FunctionDef):
                arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
                given = {a.arg: self.stated(a.annotation) for a in arguments if a.annotation}
                self.follow(node, {**names, **given})
            elif isinstance(node, ast.ClassDef):
                self.follow(node, dict(names))

    def learn(self, node: ast.AST, names: dict[str, Sections]) -> None:
        """What a statement says of the types of names."""
        if isinstance(node, ast.Assign):
            pairs = [(target, self.type_of(node.value, names)) for target in node.targets]
        elif isinstance(node, ast.AnnAssign):
            pairs = [(node.target, self.stated(node.annotation))]
            for inner in ast.walk(node):
                if isinstance(inner, ast.Lambda):
                    names |= {a.arg: pairs[0][1] for a in inner.args.args}
        elif isinstance(node, ast.For | ast.comprehension):
            pairs = [(node.target, self.type_of(node.iter, names))]
        elif isinstance(node, ast.NamedExpr):
            pairs = [(node.target, self.type_of(node.value, names))]
        else:
            return
        for target, types in pairs:
            for name in ast.walk(target):
                if isinstance(name, ast.Name) and types:
                    names[name.id] = names.get(name.id, NONE) | types

    def type_of(self, node: ast.expr, names: dict[str, Sections]) -> Sections:
        """The sections that an expression may be; what it reads on the way is noted."""
        if isinstance(node, ast.Name):
            return names.get(node.id, NONE)
        if isinstance(node, ast.Attribute):
            found, owners = NONE, self.type_of(node.value, names)
            for owner in owners:
                if node.attr in owner.model_fields:
                    self.found.add((owner.__name__, node.attr))
                    found |= frozenset(_sections_in(owner.model_fields[node.attr].annotation))
            return found if owners else self.fields[node.attr]
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            name = node.func.id if isinstance(node.func, ast.Name) else name
            if name in self.known:
                return frozenset({self.known[name]})
            within = [self.type_of(each, names) for each in node.args]
            if isinstance(node.func, ast.Attribute):
                within.append(self.type_of(node.func.value, names))
            return self.returned[name] | frozenset().union(*within)
        parts = [each for each in ast.iter_child_nodes(node) if isinstance(each, ast.expr)]
        plain = ast.BoolOp | ast.IfExp | ast.Subscript | ast.Tuple | ast.List | ast.Starred
        if isinstance(node, plain | ast.NamedExpr):
            return frozenset().union(*(self.type_of(each, names) for each in parts))
        return NONE


def _own_nodes(scope: ast.AST) -> Iterator[ast.AST]:
    """All nodes of a scope but those within its functions and classes."""
    for node in ast.iter_child_nodes(scope):
        yield node
        if not isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield from _own_nodes(node)
