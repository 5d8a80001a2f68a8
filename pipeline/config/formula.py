"""Formulas of scalp variables: "0.02 + 0.05 * smoothstep(0, 1, height)". Nothing but arithmetic can be written.

The text is parsed by Python's own parser and every node of the tree is checked against a list; no code is run.
"""

import ast
import difflib

VARIABLES = {
    "x": "place of the root, to the head's left [m]",
    "y": "upwards [m], 0 at the ear canals",
    "z": "to the front [m]",
    "u": "first coordinate of the mesh's texture, or of the scalp chart (0 to 1)",
    "v": "second coordinate",
    "height": "0 at the nape's hairline to 1 at the top of the head",
    "front": "0 at the back of the head to 1 at the forehead",
    "side": "-1 at the right ear to 1 at the left",
    "crown": "distance of the root from the whorl [m]",
    "parting": "distance of the root from the parting [m], 1 where there is none",
    "random": "a number of the strand's own, 0 to 1",
}

FUNCTIONS = {
    "smoothstep": "a, b, x",
    "mix": "a, b, part",
    "min": "a, b",
    "max": "a, b",
    "abs": "a",
    "sqrt": "a",
    "exp": "a",
    "sin": "a",
    "cos": "a",
    "noise": "scale",
}

_LONGEST = 300  # characters
_OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.USub, ast.UAdd)


def parse(text: str) -> ast.expr:
    """The tree of a formula: numbers, VARIABLES, + - * / ** and FUNCTIONS with the right number of arguments.

    Raises ValueError, naming what is allowed, for anything else.

    >>> ast.unparse(parse("0.02 + 0.05 * smoothstep(0, 1, height)"))
    '0.02 + 0.05 * smoothstep(0, 1, height)'
    >>> parse("open('/etc/passwd')")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: formula: ...
    """
    if len(text) > _LONGEST:
        raise ValueError(f"formula of {len(text)} characters; at most {_LONGEST} are read")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ValueError('not a formula, such as "0.02 + 0.05 * smoothstep(0, 1, height)"') from None
    _check(tree)
    return tree


def _check(node: ast.expr) -> None:
    match node:
        case ast.Constant(value=bool() | str() | bytes() | complex() | None):
            raise ValueError(f"formula: {ast.unparse(node)} is not a number")
        case ast.Constant(value=int() | float()):
            pass
        case ast.Name(id=name):
            if name not in VARIABLES:
                raise ValueError(f"formula: unknown variable {name!r}; {_offer(name, VARIABLES)}")
        case ast.UnaryOp(op=op, operand=inner) if isinstance(op, _OPERATORS):
            _check(inner)
        case ast.BinOp(left=left, op=op, right=right) if isinstance(op, _OPERATORS):
            _check(left)
            _check(right)
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
            if name not in FUNCTIONS:
                raise ValueError(f"formula: unknown function {name!r}; {_offer(name, FUNCTIONS)}")
            if len(arguments) != FUNCTIONS[name].count(",") + 1:
                raise ValueError(f"formula: {name} takes ({FUNCTIONS[name]}), got {ast.unparse(node)}")
            for argument in arguments:
                _check(argument)
        case _:
            raise ValueError(
                f"formula: {_cut(ast.unparse(node))} is not allowed; "
                f"use numbers, {', '.join(VARIABLES)}, + - * / ** and {', '.join(FUNCTIONS)}"
            )


def _offer(name: str, known: dict[str, str]) -> str:
    close = difflib.get_close_matches(name, known, 1)
    return f"did you mean {close[0]!r}?" if close else f"there are {', '.join(known)}"


def _cut(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."
