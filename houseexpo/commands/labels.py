"""``houseexpo labels``: write what a review has found out about houses as labels, for fits of the program's models."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def labels(
    dataset: Annotated[Path, typer.Argument(help="Data set that was built here and reviewed.", show_default=False)],
    out: Annotated[Path, typer.Option(help="File of JSON lines, one for each storey.", show_default=False)],
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite a file that houseexpo did not write.")] = False,
) -> None:
    """Write which rooms and ways of reviewed houses are right and which are wrong.

    A house that was kept tells of all its parts, one that was only corrected of what the corrections changed. The files
    of the houses are read again.
    """
    import msgspec

    from houseexpo.commands.printing import make_console
    from houseexpo.commands.serve import require_service
    from houseexpo.dataset.storey_labels import StoreyLabels
    from houseexpo.outputs import CommandOutput

    require_service("labels")
    from houseexpo.service.collection import open_collections
    from houseexpo.service.review.labels import review_labels
    from houseexpo.words import count_noun

    collection = next(iter(open_collections([dataset]).values()))
    printed = make_console()
    with CommandOutput(out, [dataset], replace=replace) as output:
        told = list(review_labels(collection))
        found = [each for each in told if isinstance(each, StoreyLabels)]
        for each in told:
            if not isinstance(each, StoreyLabels):
                printed.print(f"left out: {each}", style="yellow", highlight=False, soft_wrap=True)
        output.write(out, b"".join(msgspec.json.encode(each) + b"\n" for each in found))
    hint = "" if told else f"; nothing was reviewed: houseexpo review {dataset}"
    printed.print(f"{count_noun(len(found), 'storey')} in {out}{hint}", highlight=False, soft_wrap=True)
