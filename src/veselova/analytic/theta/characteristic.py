"""Half-integer theta characteristics [ε; δ] and those of the branch points."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

__all__ = ["Characteristic", "functions_of_attitude"]

#: Budget: orders of branch points of which the characteristics are kept.
_MOST_KEPT = 64


class Characteristic(NamedTuple):
    """[ε; δ] in halves: each entry is 0 or 1 and stands for 0 or ½. Addition is modulo one, which
    changes θ by a sign at most.
    """

    epsilon: tuple[int, ...]
    delta: tuple[int, ...]

    @classmethod
    def zero(cls, genus: int) -> Characteristic:
        """Return [0; 0], the characteristic of the common denominator θ(z)."""
        return cls((0,) * genus, (0,) * genus)

    @classmethod
    def of_branch_point(cls, j: int, genus: int) -> Characteristic:
        """Return η(b_j): η(b_0) = [0; ½…½], η(b_{2s−1}) = [½e_s; ½ from s on] (odd), η(b_{2s}) =
        [½e_s; ½ beyond s].
        """
        s = (j + 1) // 2
        epsilon = tuple(int(i == s) for i in range(1, genus + 1))
        first = s if j % 2 == 1 else s + 1
        return cls(epsilon, tuple(int(i >= first) for i in range(1, genus + 1)))

    def __add__(self, other: Characteristic) -> Characteristic:  # type: ignore[override]  # a characteristic is no list to go on
        """Return the sum modulo one, as in the two-index characteristics η(I_i) + η(c_k)."""
        return Characteristic(
            tuple((a + b) % 2 for a, b in zip(self.epsilon, other.epsilon, strict=True)),
            tuple((a + b) % 2 for a, b in zip(self.delta, other.delta, strict=True)),
        )


@lru_cache(_MOST_KEPT)
def functions_of_attitude(
    of_I: tuple[int, ...], of_c: tuple[int, ...]
) -> tuple[tuple[Characteristic, ...], tuple[int, ...]]:
    """Return the characteristics of the theta functions whose quotients are the attitude, that of
    the denominator first, and where among them the numerators stand: of q_1 … q_n, of v_k, and of
    (n_k)_i with i before k; k runs over c_2 … c_g, c_1. of_I, of_c: the j of I_i and c_k among the
    branch points b_j.
    """
    genus = len(of_c)
    one = [Characteristic.of_branch_point(j, genus) for j in of_I]
    two = [Characteristic.of_branch_point(j, genus) for j in (*of_c[1:], of_c[0])]
    numerators = [*one, *two, *(a + b for a in one for b in two)]
    functions = (Characteristic.zero(genus), *sorted(set(numerators)))
    return functions, tuple(functions.index(c, 1) for c in numerators)
