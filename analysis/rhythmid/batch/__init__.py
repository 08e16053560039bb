"""Many recordings analysed by one manifest, and compared; `rhythmid.batch(...)` calls `batch.batch.batch`."""

from rhythmid.callable_package import make_callable

make_callable(__name__)
