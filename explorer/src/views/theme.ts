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

export interface Theme {
  background: string;
  line: string;
  text: string;
  dim: string;
  dark: boolean;
  /** The colours of trails over a surface, and of the surface. */
  trail: string;
  skin: string;
}

/** Return the colours that the style sheet has at the moment. */
export function theme(): Theme {
  const style = getComputedStyle(document.documentElement);
  const value = (name: string) => style.getPropertyValue(name).trim();
  const dark = value("--dark") === "1";
  return {
    background: value("--view"),
    line: value("--line"),
    text: value("--text"),
    dim: value("--dim"),
    dark,
    trail: dark ? BLUE : "#0072b2",
    skin: dark ? "#243042" : "#dfe6ee",
  };
}
