"""Progress bars for notebooks and terminals, on tqdm, which is needed for this module only: ``pip install tqdm``."""

from __future__ import annotations

from types import TracebackType
from typing import Any

__all__ = ["Bar"]


class Bar:
    """A progress bar as the ``progress`` of any operation. Interrupting the notebook or Ctrl-C cancels.

    >>> with Bar() as progress:
    ...     result = surfrecon.merge(scans, progress=progress)
    """

    def __init__(self, **options: Any) -> None:
        """``options`` are those of ``tqdm.auto.tqdm``."""
        from tqdm.auto import tqdm

        self._bar = tqdm(total=100, bar_format="{desc:32} {percentage:3.0f} % |{bar}| {elapsed}", **options)

    def __call__(self, stage: str, fraction: float) -> bool:
        """Shows the stage and the share done. The operation goes on."""
        self._bar.set_description_str(stage, refresh=False)
        self._bar.update(100 * fraction - self._bar.n)
        return True

    def __enter__(self) -> Bar:
        """The bar itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Closes it. The bar is full if all went well."""
        if kind is None:
            self._bar.update(100 - self._bar.n)
        self._bar.close()
