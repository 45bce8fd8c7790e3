# Evaluate a closed-form document in Julia, without packages: julia evaluate.jl [document.json values.json]
# The plain theta series; documents beside a separatrix (field "reduction") need the sum of evaluate.py.
using LinearAlgebra

"The numbers of a field of a JSON text, nested lists one after the other."
function numbers(text, key)
    rest = split(text, "\"$key\":"; limit = 2)[2]
    depth, stop = 0, 0
    for (i, c) in pairs(rest)
        depth += (c == '[') - (c == ']')
        stop = i
        depth == 0 && (c == ']' || c == ',' || c == '}') && break
    end
    [parse(Float64, x.match) for x in eachmatch(r"-?\d+\.?\d*(?:[eE][-+]?\d+)?", rest[1:stop])]
end
rows(x, width) = permutedims(reshape(x, width, :))
"θ[ε;δ](z) = Σ exp(−π(m+ε)ᵀT(m+ε)) cos 2π(m+ε)·(z+δ) over the box of all terms that count."
function theta(T, epsilon, delta, z)
    R = ceil(Int, sqrt((39 / π + dot(epsilon, T, epsilon)) / eigmin(Symmetric(T))))
    sum(Iterators.product(fill(-R:R, length(z))...)) do m
        x = collect(m) .+ epsilon
        exp(-π * dot(x, T, x)) * cos(2π * dot(x, z .+ delta))
    end
end
"The time map t(τ₁) and its slope."
function time(d, tau)
    pace, turn = π .* (d.modes * d.f), 2π .* (d.modes * d.z0 .+ d.turns)
    h = pace .* tau
    d.mean * tau + sum(2 .* d.F .* cos.(turn .+ h) .* tau .* sinc.(h ./ π)), d.mean + sum(2 .* d.F .* cos.(turn .+ 2 .* h))
end
function frame(d, t)
    tau = t / d.mean
    for _ in 1:100 # Newton's method for t(τ₁) = t
        value, slope = time(d, tau)
        step = (value - t) / slope
        tau -= step
        abs(step) < 1e-15 * max(1, abs(tau)) && break
    end
    z, g = d.z0 .+ d.f .* tau, length(d.f)
    values = [theta(d.T, c[1:g], c[(g + 1):end], z) for c in eachrow(d.c)]
    entries(pairs) = [pairs[i, 2] * values[Int(pairs[i, 1]) + 1] / values[1] for i in 1:size(pairs, 1)]
    normals = hcat((entries(d.normals[(1 + k * (g + 1)):((k + 1) * (g + 1)), :]) for k in 0:(g - 2))..., entries(d.gamma))
    hcat(d.D * entries(d.q), d.D * normals * d.rotation .+ d.frozen) * d.attitude
end
files = length(ARGS) > 1 ? ARGS : ["body3.json", "body3.values.json"]
text, stored = read(files[1], String), read(files[2], String)
occursin("\"shell\":", text) && error("a shell: its frame is another sum, in section Shells of docs/closed-form.md")
g, n = length(numbers(text, "phases")), length(numbers(text, "A"))
field(key, width) = rows(numbers(text, key), width)
area = occursin("\"area\":", text) ? split(text, "\"area\":"; limit = 2)[2] : "" # of a body with an area constant: modes doubled
odd = isempty(area) ? Float64[] : numbers(area, "coefficients")
d = (; T = field("riemann_matrix", g), f = numbers(text, "frequencies"), z0 = numbers(text, "phases"),
    mean = numbers(text, "mean_rate")[1],
    modes = isempty(odd) ? field("modes", g) : vcat(field("modes", g), rows(numbers(area, "modes"), g) ./ 2),
    F = vcat(numbers(text, "coefficients"), odd), turns = vcat(zeros(length(numbers(text, "coefficients"))),
        isempty(odd) ? Float64[] : fill(numbers(area, "turn")[1], length(odd))),
    attitude = isempty(area) ? Matrix(1.0I, n, n) : rows(numbers(area, "attitude"), n),
    c = field("characteristics", 2g), q = field("q", 2), normals = field("normals", 2), gamma = field("gamma", 2),
    D = field("directions", g + 1), rotation = field("rotation", n - 1), frozen = field("frozen", n - 1))
times, frames = numbers(stored, "times"), numbers(stored, "frame")
worst = maximum(maximum(abs, frame(d, t) .- rows(frames[(1 + (i - 1) * n^2):(i * n^2)], n)) for (i, t) in enumerate(times))
println("largest deviation ", round(worst; sigdigits = 2))
