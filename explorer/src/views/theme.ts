/** Colours: those of Okabe and Ito, and those of the page, light or dark. */

export const BLUE = "#56b4e9";
export const ORANGE = "#e69f00";
export const GREEN = "#009e73";
export const VERMILION = "#d55e00";
export const PINK = "#cc79a7";

/** The font of what is written into pictures. */
export const FONT = '"DejaVu Sans", system-ui, sans-serif';

/** Colours of λ_1, λ_2, … and of the phases z_1, z_2, … */
export const SERIES = [GREEN, PINK, ORANGE, BLUE, VERMILION];

/** Return the colours that the style sheet has at the moment. */
export function theme() {
  const style = getComputedStyle(document.documentElement);
  const value = (name: string) => style.getPropertyValue(name).trim();
  const dark = value("--dark") === "1";
  return {
    background: value("--view"),
    line: value("--line"),
    text: value("--text"),
    dim: value("--dim"),
    dark,
    // Of trails over a surface, and of the surface.
    trail: dark ? BLUE : "#0072b2",
    skin: dark ? "#243042" : "#dfe6ee",
  };
}
