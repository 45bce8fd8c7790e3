/** A sentence and the formula of each number, for those who ask. */
import type { ClosedFormDocument } from "../evaluator/document.ts";
import { element, type Loaded } from "../views/view.ts";

export interface Formula {
  tex: string;
  /** What it is, in a plain sentence. */
  text: string;
}

/** The formulas that are other ones with an area constant, (Ω,γ) or (K,γ). */
const AREA_FORMULAS: Record<string, Formula> = {
  energy: {
    tex: "h=\\tfrac12(J\\Omega,\\Omega)-(\\Omega,\\gamma)(J\\Omega,\\gamma)",
    text: "A number that stays constant, unlike the energy; J is I, of a ball I + ma².",
  },
  lambda: {
    tex: "\\sum_i\\frac{v_i^2}{\\lambda_s-I_i'}=0",
    text: "Those of v, which is fixed in space like γ.",
  },
  constants: {
    tex: "\\sum_{i<j}\\frac{(v_iv_j'-v_jv_i')^2}{(\\lambda-I_i')(\\lambda-I_j')}+\\sum_i\\frac{v_i^2}{\\lambda-I_i'}=0\\ \\text{at}\\ \\lambda=c_k",
    text: "Those of v, which is fixed in space like γ.",
  },
  q: {
    tex: "v_i=\\kappa_i\\,\\frac{\\theta[\\eta(I_i)](z)}{\\theta(z)},\\qquad[\\gamma\\,e_2\\,e_3]=[v\\,e_2'\\,e_3']\\,R",
    text: "The vertical seen from the body, by quotients of theta functions of v; R is a constant rotation.",
  },
  tau: {
    tex: "\\frac{dt}{d\\tau_1}=L_{00}\\sqrt{c_2\\lambda_1\\lambda_2}-L_{10}\\,\\rho",
    text: "The closed form as data. Its modes are the waves that make up the time; ρ changes sign with z → z + 1.",
  },
  omega: {
    tex: "\\Omega=J^{-1}(K+\\sigma\\gamma)",
    text: "How fast the body turns; K is its momentum, fixed in space.",
  },
};

/** The formulas of a shell around a sphere of half its radius. */
const SHELL_FORMULAS: Record<string, Formula> = {
  energy: { tex: "h=\\tfrac12(J\\Omega,\\Omega)", text: "The energy of the motion, which never changes; J is I + ma²." },
  lambda: { tex: "\\sum_i\\frac{x_i^2}{\\lambda_s-I_i}=0", text: "Those of Neumann's point x." },
  q: {
    tex: "\\gamma_i=\\frac{\\sqrt{B_i}\\,x_i}{|\\sqrt B\\,x|},\\qquad x_i=\\kappa_i\\,\\frac{\\theta[\\eta(I_i)](z)}{\\theta(z)}",
    text: "The normal of the sphere seen from the body, from Neumann's point x.",
  },
  tau: { tex: "\\frac{dt}{d\\tau_1}=\\frac C{|\\sqrt B\\,x|}", text: "The closed form as data. Its modes are the waves that make up the time t as a function of τ₁." },
  omega: { tex: "\\Omega=\\gamma\\times\\dot\\gamma", text: "How fast the ball turns." },
};

const FORMULAS: Record<string, Formula> = {
  regime: {
    tex: "w^2=-\\lambda\\prod_i(\\lambda-I_i)\\prod_{k\\ge2}(\\lambda-c_k)",
    text: "It is generic where all zeros of this polynomial differ.",
  },
  energy: {
    tex: "h=\\frac{(A\\dot q,\\dot q)(q,Aq)-(Aq,\\dot q)^2}{2\\det A}",
    text: "The energy of the motion, which never changes.",
  },
  constants: {
    tex: "\\sum_{i<j}\\frac{(q_iq_j'-q_jq_i')^2}{(\\lambda-I_i)(\\lambda-I_j)}+\\sum_i\\frac{q_i^2}{\\lambda-I_i}=0\\ \\text{at}\\ \\lambda=c_k",
    text: "The zeros of this expression.",
  },
  phases: { tex: "z=z^0+f\\tau_1", text: "They grow evenly in the time τ₁." },
  frequencies: {
    tex: "\\frac{f}{F_0},\\qquad z=z^0+f\\tau_1",
    text: "How many turns each angle z makes in a unit of time, on average.",
  },
  rotation: { tex: "\\frac{f_s}{f_1}", text: "The ratio of two frequencies: a fraction where the motion repeats itself, else its best fraction." },
  actions: {
    tex: "J_s=\\frac1{2\\pi}\\oint\\frac12\\sqrt{\\left|\\frac{\\lambda\\prod(\\lambda-c_k)}{\\prod(\\lambda-I_i)}\\right|}\\,d\\lambda",
    text: "The area that each λ goes around, over 2π; constant, and changed slowly by slow forces alone.",
  },
  lambda: { tex: "\\sum_i\\frac{q_i^2}{\\lambda_s-I_i}=0", text: "Its equation." },
  tau: { tex: "d\\tau_1=\\sqrt{\\frac{2h\\det A}{(q,Aq)}}\\,dt", text: "The closed form as data. Its modes are the waves that make up the time t as a function of τ₁." },
  q: {
    tex: "q_i=\\kappa_i\\,\\frac{\\theta[\\eta(I_i)](z)}{\\theta(z)}",
    text: "The vertical seen from the body, a vector of length 1, by quotients of theta functions.",
  },
  error: {
    tex: "|E(t)-E_{\\text{true}}(t)|\\le e_0+e_1|t|",
    text: "How far the numbers shown may be off: the bound of the closed form.",
  },
  omega: { tex: "\\omega=q\\wedge\\dot q", text: "How fast the body turns, in radians in a unit of time." },
};

/** Return the formulas of a motion, without those that hold for other systems alone. */
export function formulasOf({ motion, document, problem }: Loaded): Record<string, Formula> {
  const all: Record<string, Formula> = { ...FORMULAS, ...(motion.body ? AREA_FORMULAS : {}), ...(document?.shell ? SHELL_FORMULAS : {}) };
  if (problem.system === "neumann") all.energy = { tex: "h=\\tfrac12(q',q')+\\tfrac12(A^{-1}q,q)", text: "The energy of the motion, which never changes." };
  if (document?.time === "s") all.energy = { tex: "h=\\tfrac12(\\dot X,\\dot X)", text: "The energy of the motion, of unit speed." };
  if (problem.system === "chaplygin-ball") all.energy = { tex: "h=\\tfrac12(K,\\Omega)", text: "The kinetic energy, which never changes." };
  if (document?.time !== "t") delete all.tau;
  if (!document) for (const name of ["q", "omega"]) delete all[name];
  return all;
}

const EVALUATION = [
  "\\begin{aligned}t=F_0\\tau_1+\\sum_{m}\\tfrac{F_m}{\\pi\\,m\\cdot f}\\bigl[&\\sin2\\pi m\\cdot(z^0+f\\tau_1)\\\\&-\\sin2\\pi m\\cdot z^0\\bigr]\\end{aligned}",
  "E_{ij}=\\kappa_{ij}\\,\\frac{\\theta[\\eta_{ij}](z)}{\\theta(z)},\\qquad z=z^0+f\\tau_1",
];

const AREA_EVALUATION = [
  "\\begin{aligned}t=F_0\\tau_1+\\sum_{2m}\\tfrac{F_m}{\\pi\\,m\\cdot f}\\bigl[&\\sin2\\pi(m\\cdot z+\\delta_m)\\\\&-\\sin2\\pi(m\\cdot z^0+\\delta_m)\\bigr]\\end{aligned}",
  "E_{ij}=\\sum_k\\kappa_{ik}\\,\\frac{\\theta[\\eta_{ik}](z)}{\\theta(z)}\\,R_{kj},\\qquad z=z^0+f\\tau_1",
];

/** Return the formulas by which the page computes the motion of a document. */
export function evaluationOf({ area, shell }: ClosedFormDocument): string[] {
  if (shell) return [EVALUATION[0], "E=\\operatorname{Re}\\sum_j\\psi_j(z)\\,e^{2\\pi i\\alpha_j\\tau_1}\\,b_j,\\qquad z=z^0+f\\tau_1"];
  return area ? AREA_EVALUATION : EVALUATION;
}

/** Return an element with a formula; its source stays where the library does not come. */
export function typeset(tex: string, displayMode = false): HTMLElement {
  const into = element(displayMode ? "div" : "span", {}, tex);
  void Promise.all([import("katex"), import("katex/dist/katex.min.css")]).then(([{ default: katex }]) =>
    katex.render(tex, into, { displayMode, throwOnError: false }),
  );
  return into;
}
