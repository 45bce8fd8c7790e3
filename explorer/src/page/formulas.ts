/** The formula and the paper's label of each number, for those who ask. */
import type { ClosedFormDocument } from "../evaluator/document.ts";
import type { Loaded } from "../views/view.ts";

export interface Formula {
  tex: string;
  label: string;
}

/** The formulas that are other ones with an area constant, (Ω,γ) or (K,γ). */
const AREA_FORMULAS: Record<string, Formula> = {
  energy: {
    tex: "h=\\tfrac12(J\\Omega,\\Omega)-(\\Omega,\\gamma)(J\\Omega,\\gamma)",
    label: "constant, unlike the energy; J = I, of a ball I + ma²",
  },
  lambda: {
    tex: "\\sum_i\\frac{v_i^2}{\\lambda_s-I_i'}=0",
    label: "(S_n) for v, which is fixed in space like γ",
  },
  constants: {
    tex: "\\sum_{i<j}\\frac{(v_iv_j'-v_jv_i')^2}{(\\lambda-I_i')(\\lambda-I_j')}+\\sum_i\\frac{v_i^2}{\\lambda-I_i'}=0\\ \\text{at}\\ \\lambda=c_k",
    label: "(family1) for v, which is fixed in space like γ",
  },
  q: {
    tex: "v_i=\\kappa_i\\,\\frac{\\theta[\\eta(I_i)](z)}{\\theta(z)},\\qquad[\\gamma\\,e_2\\,e_3]=[v\\,e_2'\\,e_3']\\,R",
    label: "(wurzel) for v; R is a constant rotation",
  },
  tau: {
    tex: "\\frac{dt}{d\\tau_1}=L_{00}\\sqrt{c_2\\lambda_1\\lambda_2}-L_{10}\\,\\rho",
    label: "time with an area constant: ρ changes sign with z → z + 1",
  },
  omega: {
    tex: "\\Omega=J^{-1}(K+\\sigma\\gamma)",
    label: "K is fixed in space",
  },
};

export const FORMULAS: Record<string, Formula> = {
  regime: {
    tex: "w^2=-\\lambda\\prod_i(\\lambda-I_i)\\prod_{k\\ge2}(\\lambda-c_k)",
    label: "(calR): generic where all branch points differ",
  },
  energy: {
    tex: "h=\\frac{(A\\dot q,\\dot q)(q,Aq)-(Aq,\\dot q)^2}{2\\det A}",
    label: "(redL)",
  },
  constants: {
    tex: "\\sum_{i<j}\\frac{(q_iq_j'-q_jq_i')^2}{(\\lambda-I_i)(\\lambda-I_j)}+\\sum_i\\frac{q_i^2}{\\lambda-I_i}=0\\ \\text{at}\\ \\lambda=c_k",
    label: "(family1)",
  },
  phases: { tex: "z=z^0+f\\tau_1", label: "(quad_neumann)" },
  frequencies: {
    tex: "\\frac{f}{F_0},\\qquad z=z^0+f\\tau_1",
    label: "(quad_neumann); cycles in a unit of the time shown",
  },
  rotation: { tex: "\\frac{f_s}{f_1}", label: "the ratio of two frequencies" },
  actions: {
    tex: "J_s=\\frac1{2\\pi}\\oint\\frac12\\sqrt{\\left|\\frac{\\lambda\\prod(\\lambda-c_k)}{\\prod(\\lambda-I_i)}\\right|}\\,d\\lambda",
    label: "(S_n), (prod_n)",
  },
  lambda: { tex: "\\sum_i\\frac{q_i^2}{\\lambda_s-I_i}=0", label: "(S_n)" },
  tau: { tex: "d\\tau_1=\\sqrt{\\frac{2h\\det A}{(q,Aq)}}\\,dt", label: "(4.6)" },
  q: {
    tex: "q_i=\\kappa_i\\,\\frac{\\theta[\\eta(I_i)](z)}{\\theta(z)}",
    label: "(wurzel) and the theta quotients it announces",
  },
  error: {
    tex: "|E(t)-E_{\\text{true}}(t)|\\le e_0+e_1|t|",
    label: "the document's own bound",
  },
  omega: { tex: "\\omega=q\\wedge\\dot q", label: "(44.3)" },
};

/** Return the formulas of a motion, without those that hold for other systems alone. */
export function formulasOf({ motion, document, problem }: Loaded): Record<string, Formula> {
  const all: Record<string, Formula> = { ...FORMULAS, ...(motion.body ? AREA_FORMULAS : {}) };
  if (problem.system === "neumann") all.energy = { tex: "h=\\tfrac12(q',q')+\\tfrac12(A^{-1}q,q)", label: "(4.7)" };
  if (document?.time === "s") all.energy = { tex: "h=\\tfrac12(\\dot X,\\dot X)", label: "of unit speed" };
  if (problem.system === "chaplygin-ball") all.energy = { tex: "h=\\tfrac12(K,\\Omega)", label: "kinetic energy" };
  if (document?.time !== "t") delete all.tau;
  if (!document) for (const name of ["q", "omega"]) delete all[name];
  return all;
}

const EVALUATION = [
  "t=F_0\\tau_1+\\sum_{m}\\frac{F_m}{\\pi\\,m\\cdot f}\\bigl[\\sin2\\pi m\\cdot(z^0+f\\tau_1)-\\sin2\\pi m\\cdot z^0\\bigr]",
  "E_{ij}=\\kappa_{ij}\\,\\frac{\\theta[\\eta_{ij}](z)}{\\theta(z)},\\qquad z=z^0+f\\tau_1",
];

const AREA_EVALUATION = [
  "t=F_0\\tau_1+\\sum_{2m}\\frac{F_m}{\\pi\\,m\\cdot f}\\bigl[\\sin2\\pi(m\\cdot z+\\delta_m)-\\sin2\\pi(m\\cdot z^0+\\delta_m)\\bigr]",
  "E_{ij}=\\sum_k\\kappa_{ik}\\,\\frac{\\theta[\\eta_{ik}](z)}{\\theta(z)}\\,R_{kj},\\qquad z=z^0+f\\tau_1",
];

/** Return the formulas by which the page computes the motion of a document. */
export function evaluationOf({ area }: ClosedFormDocument): string[] {
  return area ? AREA_EVALUATION : EVALUATION;
}

/** Write a formula into an element; its source stays where the library does not come. */
export async function typeset(tex: string, into: HTMLElement, display = false): Promise<void> {
  into.textContent = tex;
  const [{ default: katex }] = await Promise.all([
    import("katex"),
    import("katex/dist/katex.min.css"),
  ]);
  katex.render(tex, into, { displayMode: display, throwOnError: false });
}
