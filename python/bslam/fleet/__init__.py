"""Maps of many recordings on many machines, on Dask: `python -m bslam.fleet map DATA... --out SITE`.

Each recording becomes a map; maps with common places are merged into the map of a site; and each recording gets its
trajectory in that map. Results are the same for any number of workers. Needs the package distributed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._site import Recording, Site, map_recordings

__all__ = ["Recording", "Site", "map_recordings"]


def __getattr__(name: str) -> Any:
    """Imports Dask with the first use, so that the command line can say that it is missing."""
    if name not in __all__:
        raise AttributeError(name)
    from . import _site

    return getattr(_site, name)
