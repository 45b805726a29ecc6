"""Commands for many flights: `study`, `compare-laws`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from flockwire_core import clock

from flockwire_operator.cli.arguments import SwarmFile
from flockwire_operator.cli.inputs import finite, load, refuse_unused, refused

app = typer.Typer()
RandomStarts = Annotated[str | None, typer.Option(metavar="WxD", help="Random starts in a box in m, like 6x6.")]
Folder = Annotated[Path | None, typer.Option(help="Folder; a second call continues in it [runs/NAME-study-TIME].")]
Jobs = Annotated[int, typer.Option(min=0, help="Number of processes; 0: one for each core.")]
Scheduler = Annotated[str, typer.Option(metavar="ADDRESS", help="Address of a Dask cluster to use instead.")]
Search = Annotated[
    bool,
    typer.Option("--search", help="Look for the worst flight, by an optimizer, instead of drawing values at random."),
]
Liveness = Annotated[
    bool, typer.Option("--liveness", help="Search where faults end, then the formation must come back.")
]
First = Annotated[bool, typer.Option("--first", help="With --search: end at the first violation.")]
Corpus = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER", help="With --search: first fly the flights that an earlier search kept, in its folder."
    ),
]
Replay = Annotated[
    Path | None,
    typer.Option(metavar="FAULTS", exists=True, help="Fly again one flight that a search found: its file of faults."),
]

UNUSED = {  # by what `study` flies: its name in messages, and the options without effect
    "--replay": ("--replay", ("STUDY", "--search", "--runs", "--random-starts", "--jobs", "--scheduler", "--first",
                              "--corpus", "--out", "--pdf")),
    "--search": ("a search, which draws no figures", ("--pdf",)),
    "study": ("a study without --search", ("--first", "--corpus")),
}  # fmt: skip


@app.command()
def study(
    swarm: SwarmFile,
    file: Annotated[Path | None, typer.Argument(metavar="STUDY", help="The variations (TOML).")] = None,
    out: Folder = None,
    runs: Annotated[int | None, typer.Option(min=1, help="Flights at each grid point [100; search 1000].")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the whole study [0].")] = None,
    duration: Annotated[
        float | None, typer.Option(min=1.0, callback=finite, help="Seconds of each flight [20; search 8].")
    ] = None,
    random_starts: RandomStarts = None,
    jobs: Jobs = 0,
    scheduler: Scheduler = "",
    pdf: Annotated[bool, typer.Option("--pdf", help="Write each figure as PDF too.")] = False,
    search: Search = False,
    liveness: Liveness = False,
    first: First = False,
    corpus: Corpus = None,
    replay: Replay = None,
) -> None:
    """Fly the swarm many times in virtual time with variations; report the success rate, or the worst flight."""
    from flockwire_operator.cli import study as studies  # noqa: PLC0415  (numpy)

    kind = "--replay" if replay is not None else "--search" if search | liveness else "study"
    given = {"STUDY": file, "--search": search, "--runs": runs, "--random-starts": random_starts, "--jobs": jobs,
             "--scheduler": scheduler, "--first": first, "--corpus": corpus, "--out": out, "--pdf": pdf}  # fmt: skip
    what, unused = UNUSED[kind]
    refuse_unused(what, {option: given[option] for option in unused})
    if scheduler:
        refuse_unused("--scheduler", {"--jobs": jobs})
    loaded = load(swarm).swarm
    folder = out or Path("runs") / f"{loaded.name}-study-{clock.local():%Y%m%d-%H%M%S}"
    with refused(folder):
        drawn = studies.options_of(runs, seed, duration, random_starts)
        if kind == "study":
            raise typer.Exit(studies.study(swarm, file, drawn, folder, jobs, scheduler, pdf))
        from flockwire_operator.cli import search as searches  # noqa: PLC0415  (ribs)

        if replay is not None:
            raise typer.Exit(searches.replay(swarm, replay, seed, duration, liveness))
        raise typer.Exit(searches.search(swarm, file, drawn, liveness, folder, jobs, scheduler, first, corpus))


@app.command(name="compare-laws")
def compare_laws(
    swarm: SwarmFile,
    laws: Annotated[
        list[str], typer.Argument(metavar="LAW...", help="As control.law; with parameters: consensus,gain=0.5.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder; a second call continues in it [runs/NAME-laws-TIME].")
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Flights of each law.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the whole comparison.")] = 0,
    duration: Annotated[float, typer.Option(min=1.0, callback=finite, help="Seconds of each flight.")] = 20.0,
    random_starts: RandomStarts = None,
    jobs: Jobs = 0,
) -> None:
    """Fly several laws from the same starts in virtual time; write one table as text, CSV, LaTeX and PDF."""
    from flockwire_operator.cli import study as studies  # noqa: PLC0415  (numpy)

    folder = out or Path("runs") / f"{load(swarm).swarm.name}-laws-{clock.local():%Y%m%d-%H%M%S}"
    with refused(folder):
        options = studies.options_of(runs, seed, duration, random_starts)
        raise typer.Exit(studies.compare_laws(swarm, laws, options, folder, jobs))
