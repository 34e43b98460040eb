"""How a command comes to be: from the signature and the docstring of a function.

A parameter before `*` becomes an argument, one behind it an option; `**part: Unpack[Words]` becomes
an option for each key of that TypedDict. Their help stands in `Args:` of the docstring, with the
metavar in brackets: `directory (DIR): where to write`. What several commands have, such as `run`
and `output`, stands in `msgflow/cli/options.py`, by its name; a docstring may say it anew.
`Annotated[…, typer.Option(…)]` says what is left: limits, a short name.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from copy import copy
from inspect import Parameter, Signature, signature
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import docstring_parser
import typer
from typer.models import ArgumentInfo, OptionInfo

from msgflow.cli.options import ADVANCED, ADVANCED_NAMES, SHARED, one_text, path_of
from msgflow.files.default_files import DEFAULT_DATABASE

Command = Callable[..., None]
_PLACES = {"from_", "to", "via", "without"}
_METAVARS = {bool: "", int: "NUMBER", float: "NUMBER", str: "TEXT"}
"""What the help shows for a type. A switch takes nothing."""


def operation(function: Command) -> Command:
    """Make a function a command: Typer finds its parameters and its help where it looks."""
    parameters = list(parameters_of(function))
    set_parameters(function, parameters)
    function.__doc__ = "\n\n".join([_help(function), *_arguments(parameters)])
    return function


def asks(method: Callable[..., Any]) -> Callable[[Command], Command]:
    """Return a decorator: the command calls a method of `Database`, the function shows the answer.

    The command has the parameters of the method, and --db. The function gets the answer, and those
    of these values that it has a parameter for; its other parameters become options, too. The help
    is that of the method, then that of the function.
    """
    asked = list(parameters_of(method, skipped=("self",)))

    def decorate(show: Command) -> Command:
        answer, *_ = signature(show).parameters
        shown = list(parameters_of(show, skipped=(answer,)))
        plain = Parameter("database", Parameter.KEYWORD_ONLY, default=DEFAULT_DATABASE)
        database = plain.replace(annotation=_annotated(plain, Path, None))
        parameters = {each.name: each for each in [*asked, *shown, database]}
        parameters |= {each.name: each for each in asked}

        def command(**given: Any) -> None:
            from msgflow.database import Database

            words = {each.name: given[each.name] for each in asked}
            words |= {name: one_text(words[name]) for name in _PLACES & words.keys()}
            said = {name: value for name, value in words.items() if value not in (None, [])}
            with Database(given["database"]) as opened:
                found = method(opened, **said)
            show(found, **{each.name: given[each.name] for each in shown})

        set_parameters(command, list(parameters.values()))
        arguments = _arguments(parameters.values())
        command.__doc__ = "\n\n".join([_help(method), _help(show), *arguments])
        return command

    return decorate


def set_parameters(command: Command, parameters: Sequence[Parameter]) -> None:
    """Give a command the parameters from which Typer makes its arguments and options."""
    ordered = sorted(
        parameters,
        key=lambda each: (each.kind, get_args(each.annotation)[1].rich_help_panel == ADVANCED),
    )
    command.__signature__ = Signature(ordered)  # type: ignore[attr-defined]
    command.__annotations__ = {each.name: each.annotation for each in parameters}


def parameters_of(
    function: Callable[..., Any], skipped: Container[str] = ()
) -> Iterator[Parameter]:
    """Yield the parameters of a function, annotated for Typer."""
    documented = {each.arg_name: each for each in _parsed(function).params}
    for parameter in signature(function).parameters.values():
        if parameter.name in skipped:
            continue
        # One by one: not every type of a function is imported where no type checker runs.
        hint = eval(parameter.annotation, function.__globals__)
        if parameter.kind is Parameter.VAR_KEYWORD:
            (words,) = get_args(hint)
            for name, kind in get_type_hints(words).items():
                word = Parameter(name, Parameter.KEYWORD_ONLY, default=None)
                yield word.replace(annotation=_annotated(word, kind, None))
        else:
            said = documented.get(parameter.name)
            annotation = _annotated(parameter, hint, said)
            default = None if parameter.default == () else parameter.default
            if get_args(annotation)[0] is Path and isinstance(default, str):
                default = Path(default)
            yield parameter.replace(default=default, annotation=annotation)


def _arguments(parameters: Iterable[Parameter]) -> Iterator[str]:
    """Yield what arguments are. Typer would show their types as Python writes them."""
    for parameter in parameters:
        _, info = get_args(parameter.annotation)
        if isinstance(info, ArgumentInfo) and info.help:
            info.hidden = True
            name = (info.metavar or parameter.name.upper()).strip("[].")
            yield f"{escape(name)}: {info.help}"


def escape(text: str) -> str:
    """Return a text without markup: Rich prints it as it is."""
    # Loading that takes longer than all texts, and hardly one has any.
    if "[" not in text and not text.endswith("\\"):
        return text
    from rich import markup

    return markup.escape(text)


def _annotated(
    parameter: Parameter, hint: Any, said: docstring_parser.DocstringParam | None
) -> Any:
    """Return the type of a parameter with what Typer should know of it."""
    kind, *infos = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    is_argument = parameter.kind is Parameter.POSITIONAL_OR_KEYWORD
    plain = typer.Argument() if is_argument else typer.Option()
    info = copy(infos[0] if infos else SHARED.get(parameter.name, plain))
    if parameter.default:
        info.show_default = True
    if said is not None:
        text = " ".join((said.description or "").split()).removesuffix(".")
        info.help = escape(text[:1].upper() + text[1:])
        info.metavar = said.type_name or info.metavar
    if isinstance(info, OptionInfo) and info.default is ...:
        word = parameter.name.strip("_").replace("_", "-")
        info.default = f"--{word}/--no-{word}" if parameter.default is True else f"--{word}"
    kind = _plain(kind)
    if Path in (kind, *get_args(kind)):
        info.parser, info.metavar = path_of, info.metavar or "FILE"
    if isinstance(info, OptionInfo):
        types = (kind, *get_args(kind))
        if info.metavar is None:
            info.metavar = next((_METAVARS[each] for each in types if each in _METAVARS), None)
        if parameter.name in ADVANCED_NAMES:
            info.rich_help_panel = ADVANCED
    return Annotated[kind, info]


def _plain(hint: Any) -> Any:
    """Return the type of a value on the command line, where all is text."""
    types = get_args(hint) if get_origin(hint) is UnionType else (hint,)
    if any(get_origin(each) is Sequence for each in types):
        return list[str] | None
    kind = next((each for each in (Path, str) if each in types), None)
    if kind is None:
        return hint
    return kind | None if NoneType in types else kind


def _help(function: Callable[..., Any]) -> str:
    paragraphs = (_parsed(function).description or "").split("\n\n")
    return escape("\n\n".join(" ".join(each.split()) for each in paragraphs))


def _parsed(function: Callable[..., Any]) -> docstring_parser.Docstring:
    return docstring_parser.parse(function.__doc__ or "", docstring_parser.DocstringStyle.GOOGLE)
