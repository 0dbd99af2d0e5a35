"""The server: the page, its WebSocket, uploads and downloads."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import secrets
import shutil
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from udd._util.number_text import number_in
from udd._util.tables import parsed, table
from udd.errors import UddError
from udd.models import Disk

from . import limits, table_columns, uploads
from .calculators import Calculators
from .class_pages import Pages
from .error_text import sentence
from .folders import workspace
from .growing_run import as_csv
from .jobs import REFUSED, Jobs
from .presets import catalogue
from .security import REPORT_POLICY, Guard
from .spec import start_of
from .stream import Page

STATIC = Path(__file__).parent / "static"
#: Options of the tracker that a page may send.
HINTS = ("clicks", "region", "fps", "leave_out", "pivot", "bob")


def make_app(
    token: str,
    hosts: list[str],
    *,
    any_address: bool = False,
    prepared: bool = False,
    classroom: bool = False,
) -> Starlette:
    """Make the application: it answers to these hosts (``name:port``) and those who know the token.

    With `prepared`, processes wait for the first question. In a `classroom` the page takes no files and makes
    no films, and one address may open a few pages.
    """
    jobs = Jobs()
    pages = Pages(limits.CLASS_PAGES if classroom else None)
    state: dict[str, Any] = {}

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        with workspace() as folder:
            # Sections have processes of their own: a diagram takes a hundred times as long.
            budgets = {"runs": limits.RUNS, "sections": limits.MAPS, "maps": limits.MAPS}
            calculators = {kind: Calculators(budget, kind) for kind, budget in budgets.items()}
            state.update(folder=folder, **calculators, calculators=calculators)
            ready = asyncio.gather(*(c.prepare() for c in calculators.values())) if prepared else None
            try:
                async with jobs:
                    yield
            finally:
                if ready is not None:
                    ready.cancel()
                await asyncio.gather(*(c.close() for c in calculators.values()))

    async def page(_: Request) -> Response:
        return FileResponse(STATIC / "index.html")

    async def about(_: Request) -> Response:
        return JSONResponse({**catalogue(), "classroom": classroom})

    async def clicks(_: Request) -> Response:
        with as_file(files("udd.report") / "templates" / "clicks.js") as script:
            return Response(script.read_bytes(), media_type="text/javascript")

    async def run_table(request: Request) -> Response:
        start = start_of(parsed("the run", request.query_params.get("run", "")))
        seconds = _number(request, "seconds") or math.nan
        shown = request.query_params.get("units") == "shown"
        text = await _while_there(request, state["maps"].ask(as_csv, start, seconds, shown))
        return _download(Response(text, media_type="text/csv"), "udd-run.csv")

    async def new_job(request: Request) -> Response:
        kind = request.path_params["kind"]
        folder = uploads.private_folder(state["folder"])
        try:
            asked = await (
                _again(jobs, request, folder) if kind == "again" else _asked(kind, request, folder)
            )
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        return JSONResponse({"job": jobs.submit(asked, folder).id})

    async def columns(request: Request) -> Response:
        folder = uploads.private_folder(state["folder"])
        try:
            file = await uploads.receive(request.stream(), folder)
            if file.suffix == ".film":
                raise UddError("This is no table.")
            return JSONResponse(await _while_there(request, state["maps"].ask(table_columns.look, file)))
        except UddError as error:
            raise type(error)(str(error).replace(str(folder), "").replace("/upload.csv: ", "")) from None
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    async def result(request: Request) -> Response:
        job = jobs.jobs.get(request.path_params["job"])
        file = job.file(request.path_params["name"]) if job is not None else None
        if file is None:
            return PlainTextResponse("There is no such file any more.", 404)
        response = FileResponse(file)
        if file.suffix in (".html", ".svg"):
            response.headers["content-security-policy"] = REPORT_POLICY
        return _download(response, f"udd-{file.name}") if "download" in request.query_params else response

    async def socket(websocket: WebSocket) -> None:
        await pages.serve(websocket, Page(websocket, jobs, state["calculators"]))

    routes = [
        Route("/", page),
        Route("/api/catalogue", about),
        Route("/api/run.csv", run_table),
        WebSocketRoute("/api/socket", socket),
        Route("/static/clicks.js", clicks),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    files_routes = [
        Route("/api/table", columns, methods=["POST"]),
        Route("/api/jobs/{kind}", new_job, methods=["POST"]),
        Route("/api/jobs/{job}/{name}", result),
    ]
    if classroom:
        routes += [
            Route("/api/table", _no_files, methods=["POST"]),
            Route("/api/jobs/{rest:path}", _no_files, methods=["GET", "POST"]),
        ]
    else:
        routes += files_routes
    handlers: dict[Any, Callable[..., Any]] = {UddError: _refused}
    guard = Middleware(Guard, token=token, hosts=hosts, any_address=any_address)
    app = Starlette(routes=routes, middleware=[guard], exception_handlers=handlers, lifespan=lifespan)
    app.state.jobs, app.state.parts = jobs, state
    return app


async def _no_files(_: Request) -> Response:
    return PlainTextResponse("This page was started for a class: it takes no files and makes no films.", 403)


async def _while_there(request: Request, work: Coroutine[Any, Any, Any]) -> Any:
    """Return what the work returns; it ends when the visitor has gone."""

    async def gone() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass

    tasks = [asyncio.ensure_future(work), asyncio.ensure_future(gone())]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        if not tasks[0].done():
            raise UddError("The visitor has gone.")
        return tasks[0].result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)


def new_token() -> str:
    """Return a new secret for the link."""
    return secrets.token_urlsafe(24)


async def _again(jobs: Jobs, request: Request, folder: Path) -> dict[str, Any]:
    """Return the question of a job with a refused film again, with what was clicked in it."""
    hints = table("the clicks", parsed("the clicks", await uploads.text(request.stream())), HINTS)
    job = jobs.jobs.get(request.query_params.get("of", ""))
    if job is None or REFUSED not in job.part_names:
        raise UddError("The film is not here any more: choose it again.")
    os.link(job.folder / job.asked["file"], folder / job.asked["file"])
    return {**job.asked, "hints": hints}


#: Numbers that come with a file, in m and s; the last two are the ends of the part of a table to use.
_NUMBERS = ("W", "R", "length", "begin", "end")


async def _asked(kind: str, request: Request, folder: Path) -> dict[str, Any]:
    """Return the question to a job; its file is put into its folder."""
    given: dict[str, Any] = {
        name: value for name in _NUMBERS if (value := _number(request, name)) is not None
    }
    if kind == "film":
        declared = request.headers.get("content-length", "0")
        if declared.isdigit() and int(declared) > limits.UPLOAD:
            raise uploads.TooLarge(f"The file is larger than {limits.UPLOAD >> 20} MB.")
        file = await uploads.receive(request.stream(), folder)
        chosen = parsed("the columns", request.query_params.get("columns") or "[]")
        film = file.suffix == ".film"
        if film:
            given["options"] = _track_options(request, given)
        return {"kind": "loop", "file": file.name, "film": film, "columns": chosen, **given}
    if kind == "sample":
        from udd.demo import pipeline

        with as_file(files("udd") / "demo" / "sample.mp4") as sample:
            shutil.copyfile(sample, folder / "sample.mp4")
        return {
            "kind": "loop",
            "file": "sample.mp4",
            "film": True,
            "options": {"disk_radius": pipeline.R},
            "W": pipeline.W,
            "R": pipeline.R,
            "origin": pipeline.ORIGIN,
        }
    if kind == "render":
        start = parsed("the run", await uploads.text(request.stream()))
        seconds = _number(request, "seconds") or 0.0
        if not isinstance(start_of(start).model, Disk):
            raise UddError("Only a run of the disk can be filmed.")
        if not 0.5 <= seconds <= limits.RENDERED:
            raise UddError(f"A film lasts from 0.5 to {limits.RENDERED:g} s.")
        return {"kind": "render", "start": start, "seconds": seconds}
    raise UddError("There is no such job.")


def _track_options(request: Request, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of `udd.track` that come with a film: entries of a config file, and the fields."""
    from udd.tracking.calibration.config import read_options

    config: dict[str, Any] = parsed("the layout file", request.query_params.get("config", ""), toml=True)
    said: dict[str, Any] = {"disk_radius": given.get("R")}
    if bob := request.query_params.get("bob"):
        said |= {"bob": bob, "length": given.get("length")}
    options = read_options(config, **said)
    if options.bob is not None and options.length is None:
        raise UddError("A pendulum's film needs the length, in m, from the pivot to the bob.")
    return config | {name: value for name, value in said.items() if value is not None}


def _number(request: Request, name: str) -> float | None:
    text = request.query_params.get(name)
    if text is None or not text.strip():
        return None
    try:
        value = number_in(text)
    except ValueError as error:
        raise UddError(f"{name} must be a number: {error}.") from None
    if not math.isfinite(value):
        raise UddError(f"{name} must be finite.")
    return value


def _download(response: Response, name: str) -> Response:
    response.headers["content-disposition"] = f'attachment; filename="{name}"'
    return response


async def _refused(_: Request, error: Exception) -> Response:
    return PlainTextResponse(sentence(error), 413 if isinstance(error, uploads.TooLarge) else 400)
