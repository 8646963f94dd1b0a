"""What the statistics ask of a factor; `calibration.study.factors` has those of a study."""

from typing import Any, ClassVar, Protocol


class CodedFactor(Protocol):
    """A factor whose coded level runs from -1 (low) to +1 (high), each in the factor's own unit."""

    has_middle: ClassVar[bool]

    @property
    def code(self) -> str:
        """A letter or two."""

    @property
    def name(self) -> str:
        """Its name in tables."""

    @property
    def low(self) -> float:
        """Natural level at -1."""

    @property
    def high(self) -> float:
        """Natural level at +1."""

    @property
    def centre(self) -> float:
        """Natural level at 0."""

    @property
    def half_range(self) -> float:
        """Half of high - low."""

    def natural(self, coded: Any) -> Any:
        """Natural level of a coded one."""

    def coded(self, natural: Any) -> Any:
        """Coded level of a natural one."""
