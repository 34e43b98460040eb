"""How a command comes to be: from the signature and the docstring of a function.

Its summary is the first sentence of the docstring; if the function is called `command`, that of its
module.

A parameter before `*` becomes an argument, one behind it an option; `**part: Unpack[Words]` becomes
an option for each key of that TypedDict; a `Database` is that of --db, open while the function
runs. Their help stands in `Args:` of the docstring, with the metavar in brackets: `directory (DIR):
where to write`. What several commands have, such as `run` and `output`, stands in
`msgflow/cli/options.py`, by its name; a docstring may say it anew. `Annotated[…, typer.Option(…)]`
says what is left: limits, a short name. A parameter in the header of an SQL file becomes an option,
too.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from copy import copy
from inspect import Parameter, Signature, signature
from pathlib import Path
from types import NoneType, SimpleNamespace, UnionType
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin, get_type_hints

import docstring_parser
import typer
from typer.models import OptionInfo

from msgflow.cli.completion import complete
from msgflow.cli.options import ADVANCED, ADVANCED_NAMES, SHARED, one_text, path_of
from msgflow.database import Database
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.query.names import PLACE_PARAMETERS

if TYPE_CHECKING:
    from msgflow.sql.header import Param

Command = Callable[..., None]
OWN = "own_"
_PLACES = {"from_", "to", "via", "without"}
_METAVARS = {int: "NUMBER", float: "NUMBER", str: "TEXT"}
"""What the help shows for a type."""


def operation(function: Command) -> Command:
    """Return a command that calls a function, in which Typer finds its parameters and its help."""
    has_database = function.__annotations__.get("database") == "Database"

    def command(*given: Any, **named: Any) -> None:
        if not has_database:
            function(*given, **named)
            return
        with Database(named.pop("database")) as database:
            function(*given, database=database, **named)

    return _described(command, list(parameters_of(function)), _help(function))


def extends(method: Callable[..., Any]) -> Callable[[Command], Command]:
    """Return a decorator: the command has the parameters of a method, too.

    The function gets those values that were given, as `asked`, for a call of the method.
    """

    def decorate(function: Command) -> Command:
        own = list(parameters_of(function, skipped=("asked",)))
        asked = list(parameters_of(method, skipped=("self", *(each.name for each in own))))

        def command(**given: Any) -> None:
            words = {each.name: given[each.name] for each in own if each.name != "database"}
            with Database(given["database"]) as database:
                function(database=database, **words, **_said(given, asked))

        return _described(command, [*asked, *own], _help(function))

    return decorate


def asks(method: Callable[..., Any]) -> Callable[[Command], Command]:
    """Return a decorator: the command calls a method of `Database`, the function shows the answer.

    The command has the parameters of the method, and --db. The function gets the answer, and those
    of these values that it has a parameter for; its other parameters become options, too. The help
    is that of the method, then that of the function.
    """
    database, *asked = parameters_of(method)

    def decorate(show: Command) -> Command:
        answer, *_ = signature(show).parameters
        shown = list(parameters_of(show, skipped=(answer,)))

        def command(**given: Any) -> None:
            with Database(given["database"]) as opened:
                found = method(opened, **_said(given, asked))
            show(found, **{each.name: given[each.name] for each in shown})

        parameters = {each.name: each for each in [*asked, *shown]}
        parameters |= {each.name: each for each in [database, *asked]}
        # The summary of a module's only command is the first sentence of the module.
        more = (_parsed(method).long_description or "").strip()
        text = more if show.__name__ == "command" else _help(method)
        return _described(command, list(parameters.values()), text, _help(show))

    return decorate


def _said(given: Mapping[str, Any], asked: Iterable[Parameter]) -> dict[str, Any]:
    """Return the values that were given, as a method takes them."""
    words = {each.name: given[each.name] for each in asked}
    words |= {name: one_text(words[name]) for name in _PLACES & words.keys()}
    return {name: value for name, value in words.items() if value not in (None, [])}


def _described(command: Command, parameters: Sequence[Parameter], *paragraphs: str) -> Command:
    set_parameters(command, parameters)
    command.__doc__ = "\n\n".join(filter(None, paragraphs))
    return command


def set_parameters(command: Command, parameters: Sequence[Parameter]) -> None:
    """Give a command the parameters from which Typer makes its arguments and options."""
    ordered = sorted(
        parameters,
        key=lambda each: (
            each.kind,
            each.default == DEFAULT_DATABASE,
            get_args(each.annotation)[1].rich_help_panel == ADVANCED,
        ),
    )
    command.__signature__ = Signature(ordered)  # type: ignore[attr-defined]
    command.__annotations__ = {each.name: each.annotation for each in parameters}


def parameters_of(
    function: Callable[..., Any], skipped: Container[str] = ()
) -> Iterator[Parameter]:
    """Yield the parameters of a function, annotated for Typer."""
    documented = {each.arg_name: each for each in _parsed(function).params}
    names = function.__annotations__.keys() - {"return"}
    # Types of what is skipped may only be imported where a type checker runs.
    written = {name: function.__annotations__[name] for name in names if name not in skipped}
    hints = get_type_hints(
        SimpleNamespace(__annotations__=written), function.__globals__, include_extras=True
    )
    for parameter in signature(function).parameters.values():
        if parameter.name in skipped:
            continue
        if parameter.name == "self":
            parameter = parameter.replace(name="database")
        hint = hints.get(parameter.name, Database)
        if hint is Database:
            option = Parameter(parameter.name, Parameter.KEYWORD_ONLY, default=DEFAULT_DATABASE)
            yield option.replace(annotation=_annotated(option, Path, None))
        elif parameter.kind is Parameter.VAR_KEYWORD:
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
        info.help = text[:1].upper() + text[1:]
        info.metavar = said.type_name or info.metavar
        # What others have by default may not hold here.
        info.show_default = info.show_default is True
    if isinstance(info, OptionInfo) and info.default is ...:
        word = parameter.name.strip("_").removesuffix("_id").replace("_", "-")
        info.default = f"--{word}/--no-{word}" if parameter.default is True else f"--{word}"
    kind = _plain(kind)
    if Path in (kind, *get_args(kind)):
        info.parser, info.metavar = path_of, info.metavar or "FILE"
    if isinstance(info, OptionInfo):
        types = (kind, *get_args(kind))
        if parameter.name.endswith("_id"):
            info.metavar = "ID"
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
    return (_parsed(function).description or "").strip()


def _parsed(function: Callable[..., Any]) -> docstring_parser.Docstring:
    return docstring_parser.parse(function.__doc__ or "", docstring_parser.DocstringStyle.GOOGLE)


def header_option(param: Param, panel: str = "Parameters") -> Any:
    """Return the option for a parameter of a header, in which the default stands."""
    flag = f"--{param.name.replace('_', '-')}"
    metavar = "TEXT" if param.type == "VARCHAR" else "NUMBER"
    completion: Callable[..., list[str]] | None = None
    if param.name in PLACE_PARAMETERS:
        metavar, completion = "NAME", complete("place")
    elif param.choices:
        metavar, completion = "WORD", lambda: list(param.choices)
    return typer.Option(
        f"{flag}/--no-{flag[2:]}" if param.type == "BOOLEAN" else flag,
        metavar=metavar,
        help=_describe(param),
        show_default=False,
        autocompletion=completion,
        rich_help_panel=ADVANCED if param.name in ADVANCED_NAMES else panel,
    )


def header_parameter(param: Param) -> Parameter:
    """Return the parameter of a command for a parameter of a header, with OWN before its name."""
    kind: Any = bool if param.type == "BOOLEAN" else str
    if param.name in PLACE_PARAMETERS:
        kind = list[str]
    return Parameter(
        f"{OWN}{param.name}",
        Parameter.KEYWORD_ONLY,
        default=None if param.has_default else Parameter.empty,
        annotation=Annotated[kind | None, header_option(param)],
    )


def _describe(param: Param) -> str:
    text = param.description
    if param.choices:
        text += f" ({', '.join(param.choices)})"
    if param.minimum is not None:
        text += f" (at least {param.minimum})"
    # A switch is off unless its help says that it is on.
    if param.has_default and param.default not in (None, False):
        text += f" [default: {'on' if param.default is True else param.default}]"
    return text


def given_of(words: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of those parameters of a header that were given."""
    own = {name.removeprefix(OWN): value for name, value in words.items() if name.startswith(OWN)}
    return {
        name: one_text(value) for name, value in own.items() if value is not None and value != []
    }
