"""Measure the mass of the package: what its source says, not how it is laid out.

Usage: python tests/measure.py [--baseline | FOLDER ...]

Without arguments it prints the table of CONTRIBUTING.md. FOLDERs, such as another project's
package, are measured in the same way. --baseline writes anew what stands above a ceiling.
"""

import argparse
import ast
import csv
import io
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pygments.lexers import get_lexer_for_filename
from pygments.token import Comment, Text

ROOT = Path(__file__).parents[1]
BASELINE = Path(__file__).with_name("above_ceilings.csv")
PACKAGE = "suave_des"
OWN_MODULES = "suave_des/modules"  # those of the package itself, below no other package
ASSETS = {".js", ".css", ".html"}

MOST_COMPLEX = 12
MOST_PARAMETERS = 6
LONGEST_LINE = 100

Function = ast.FunctionDef | ast.AsyncFunctionDef
BRANCHES = (ast.If, ast.For, ast.AsyncFor, ast.While, ast.ExceptHandler, ast.IfExp, ast.Assert)
COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}


@dataclass(frozen=True)
class Excess:
    """Something that stands above a ceiling.

    Attributes:
        kind: which ceiling.
        place: file, and the function in it.
        amount: complexity, number of parameters, or how often it occurs there.
    """

    kind: str
    place: str
    amount: int


@dataclass(frozen=True)
class Mass:
    """The mass of some source files."""

    tokens: int
    code_lines: int
    lines: int
    long_lines: int
    complexities: tuple[int, ...]
    uses_of_any: int
    data_classes: int


def files_of(place: str) -> list[Path]:
    """Return the source files of a row of the table; of the package itself, its own modules."""
    if place == OWN_MODULES:
        return sorted((ROOT / PACKAGE).glob("*.py"))
    folder = ROOT / place
    return sorted(
        path for path in folder.rglob("*") if path.suffix == ".py" or path.suffix in ASSETS
    )


def places() -> list[str]:
    """Return the rows of the table: the whole, its own modules, and each package."""
    folders = sorted((ROOT / PACKAGE).iterdir())
    packages = [f"{PACKAGE}/{path.name}" for path in folders if (path / "__init__.py").exists()]
    return [PACKAGE, OWN_MODULES, *packages]


def tokens_of(path: Path) -> int:
    """Count the tokens of a file, without comments, docstrings and layout."""
    text = path.read_text(encoding="utf-8")
    if path.suffix in ASSETS:
        read = get_lexer_for_filename(path.name).get_tokens(text)
        return sum(kind not in Comment and kind not in Text and bool(said) for kind, said in read)
    return len(said_in(text))


def said_in(text: str) -> list[tokenize.TokenInfo]:
    """Return the tokens of Python source, without comments, docstrings and layout."""
    prose = {
        line
        for node in ast.walk(ast.parse(text))
        if is_prose(node)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    tokens = whole_texts(tokenize.generate_tokens(io.StringIO(text).readline))
    return [each for each in tokens if each.type not in LAYOUT and each.start[0] not in prose]


def whole_texts(tokens: Iterator[tokenize.TokenInfo]) -> Iterator[tokenize.TokenInfo]:
    """Yield tokens with each formatted text as one, of which Python makes several from 3.12 on."""
    depth = 0
    for each in tokens:
        kind = tokenize.tok_name[each.type]
        is_end = kind.endswith("STRING_END")
        if is_end:
            depth -= 1
        if depth == 0 and not is_end:
            yield each
        if kind.endswith("STRING_START"):
            depth += 1


def is_prose(node: ast.AST) -> bool:
    """Return whether a statement is a text that stands by itself, as docstrings do."""
    is_constant = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return is_constant and isinstance(node.value.value, str)


def functions_of(tree: ast.AST, inside: str = "") -> Iterator[tuple[str, Function]]:
    """Yield each function of a module with its qualified name, those inside others too."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, Function | ast.ClassDef):
            name = f"{inside}.{node.name}" if inside else node.name
            if isinstance(node, Function):
                yield name, node
            yield from functions_of(node, name)
        else:
            yield from functions_of(node, inside)


def own_nodes(function: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a function, without those of functions inside it."""
    for node in ast.iter_child_nodes(function):
        if not isinstance(node, Function):
            yield node
            yield from own_nodes(node)


def complexity(function: Function) -> int:
    """Count the ways through a function as radon does.

    Conditional expressions, `and`, `or`, comprehensions and their conditions count, too.
    """
    return 1 + sum(ways(node) for node in own_nodes(function))


def ways(node: ast.AST) -> int:
    """Return how many ways a node adds to its function."""
    match node:
        case ast.BoolOp(values=values):
            return len(values) - 1
        case ast.comprehension(ifs=conditions):
            return 1 + len(conditions)
        case ast.match_case(pattern=ast.MatchAs(pattern=None)):
            return 0
        case ast.match_case():
            return 1
    return int(isinstance(node, BRANCHES))


def parameters(function: Function) -> int:
    """Count the parameters of a function, without self and cls."""
    arguments = function.args
    names = [each.arg for each in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]
    return len([name for name in names if name not in {"self", "cls"}])


def assigns_unlike_things(node: ast.AST) -> bool:
    """Return whether a statement gives several names a value each; an exchange is one thing."""
    if not isinstance(node, ast.Assign) or not isinstance(node.value, ast.Tuple):
        return False
    (target, *_) = node.targets
    if not isinstance(target, ast.Tuple):
        return False
    is_exchange = sorted(map(ast.unparse, target.elts)) == sorted(map(ast.unparse, node.value.elts))
    return not is_exchange


def forms(function: Function) -> dict[str, int]:
    """Count the forms in a function that say several things at once."""
    nodes = list(own_nodes(function))
    conditional = [node for node in nodes if isinstance(node, ast.IfExp)]
    comprehensions = [node for node in nodes if isinstance(node, COMPREHENSIONS)]
    return {
        "chained conditional": sum(holds(node, ast.IfExp) for node in conditional),
        "nested comprehension": sum(holds(node, COMPREHENSIONS) for node in comprehensions),
        "unlike assignment": sum(map(assigns_unlike_things, nodes)),
    }


def holds(node: ast.AST, kinds: type | tuple[type, ...]) -> bool:
    """Return whether a node has one of some kinds inside it."""
    return any(isinstance(each, kinds) for each in ast.walk(node) if each is not node)


def above_ceilings(path: Path) -> Iterator[Excess]:
    """Yield what stands above a ceiling in a Python file."""
    text = path.read_text(encoding="utf-8")
    file = path.relative_to(ROOT).as_posix()
    for name, function in functions_of(ast.parse(text)):
        place = f"{file}: {name}"
        if complexity(function) > MOST_COMPLEX:
            yield Excess("complexity", place, complexity(function))
        if parameters(function) > MOST_PARAMETERS:
            yield Excess("parameters", place, parameters(function))
        for kind, amount in forms(function).items():
            if amount:
                yield Excess(kind, place, amount)
    long_lines = sum(len(line) > LONGEST_LINE for line in text.splitlines())
    if long_lines:
        yield Excess("long lines", file, long_lines)


def measure(paths: list[Path]) -> Mass:
    """Measure source files together; all but the tokens is of Python files only."""
    texts = [path.read_text(encoding="utf-8") for path in paths if path.suffix == ".py"]
    trees = [ast.parse(text) for text in texts]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    functions = [function for tree in trees for _, function in functions_of(tree)]
    classes = [node for node in nodes if isinstance(node, ast.ClassDef)]
    lines = [line for text in texts for line in text.splitlines()]
    said = [token for text in texts for token in {each.start[0] for each in said_in(text)}]
    return Mass(
        tokens=sum(map(tokens_of, paths)),
        code_lines=len(said),
        lines=len(lines),
        long_lines=sum(len(line) > LONGEST_LINE for line in lines),
        complexities=tuple(map(complexity, functions)),
        uses_of_any=sum(isinstance(node, ast.Name) and node.id == "Any" for node in nodes),
        data_classes=sum(is_data_class(node) for node in classes),
    )


def is_data_class(node: ast.ClassDef) -> bool:
    """Return whether a class is decorated as a data class."""
    return any("dataclass" in ast.unparse(decorator) for decorator in node.decorator_list)


def recorded() -> list[Excess]:
    """Read the baseline: what stood above a ceiling when the ceilings were set, and still does."""
    with BASELINE.open(encoding="utf-8", newline="") as file:
        return [
            Excess(row["kind"], row["place"], int(row["amount"])) for row in csv.DictReader(file)
        ]


def present() -> list[Excess]:
    """Return what stands above a ceiling in the package."""
    files = [path for path in files_of(PACKAGE) if path.suffix == ".py"]
    return [excess for path in files for excess in above_ceilings(path)]


def write_baseline() -> None:
    """Write what stands above a ceiling into the baseline."""
    with BASELINE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["kind", "place", "amount"])
        for excess in sorted(present(), key=lambda each: (each.kind, each.place)):
            writer.writerow([excess.kind, excess.place, excess.amount])


def described(mass: Mass) -> str:
    """Describe a mass in one line."""
    above_10 = sum(each > 10 for each in mass.complexities)
    above_15 = sum(each > 15 for each in mass.complexities)
    python = mass.tokens / max(mass.code_lines, 1)
    return (
        f"{mass.tokens:,} tokens, {python:.1f} a line of code; "
        f"{mass.long_lines / max(mass.lines, 1):.1%} of lines above {LONGEST_LINE} characters; "
        f"{above_10} functions above complexity 10, {above_15} above 15, "
        f"the most complex {max(mass.complexities, default=0)}; "
        f"{mass.uses_of_any} uses of Any; {mass.data_classes} data classes"
    )


def main() -> None:
    """Print the table, or the mass of the given folders; or write the baseline."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--baseline", action="store_true", help="write what is above a ceiling")
    chosen = parser.parse_args()
    if chosen.baseline:
        write_baseline()
        return
    for folder in chosen.folders:
        print(f"{folder.name}: {described(measure(sorted(folder.rglob('*.py'))))}")
    if chosen.folders:
        return
    print("| place | tokens |\n| --- | ---: |")
    for place in places():
        print(f"| `{place}` | {sum(map(tokens_of, files_of(place))):,} |")
    print(described(measure([path for path in files_of(PACKAGE) if path.suffix == ".py"])))


if __name__ == "__main__":
    main()
