checkpoint plan_response_surface:
    input:
        ascent=f"{STUDY}/ascent/ascent.json",
        factors=SETTINGS.factors,
        fixed=BENCH_VALUES,
    output:
        design=f"{STUDY}/response_surface/design.csv",
        plan=f"{STUDY}/response_surface/plan.json",
        region=f"{STUDY}/response_surface/region.json",
    log:
        f"{STUDY}/logs/plan_response_surface.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "plan the response surface: Box-Behnken design"
    script:
        "../scripts/plan_response_surface.py"


rule response_surface:
    input:
        design=f"{STUDY}/response_surface/design.csv",
        region=f"{STUDY}/response_surface/region.json",
        runs=lambda w: results_of(checkpoints.plan_response_surface.get().output.plan),
    output:
        runs=f"{STUDY}/response_surface/runs.csv",
        coefficients=f"{STUDY}/response_surface/coefficients.csv",
        anova=f"{STUDY}/response_surface/anova.csv",
        diagnostics=f"{STUDY}/response_surface/diagnostics.csv",
        summary=f"{STUDY}/response_surface/response_surface.json",
        further=for_further_targets("response_surface/{}.json"),
        further_figures=for_further_targets("response_surface/surfaces_{}.svg"),
        predicted=report(
            f"{STUDY}/response_surface/predicted_actual.svg",
            caption="../report/predicted_actual.rst",
            category="3 Response surface",
        ),
        residuals=report(
            f"{STUDY}/response_surface/residuals.svg",
            caption="../report/residuals.rst",
            category="3 Response surface",
        ),
        perturbation=report(
            f"{STUDY}/response_surface/perturbation.svg",
            caption="../report/perturbation.rst",
            category="3 Response surface",
        ),
        surfaces=report(
            f"{STUDY}/response_surface/surfaces.svg",
            caption="../report/surfaces.rst",
            category="3 Response surface",
        ),
    log:
        f"{STUDY}/logs/response_surface.log",
    conda:
        "../envs/calibration.yaml"
    params:
        settings=SETTINGS_DIGEST,
    message:
        "response surface: quadratic model and its ANOVA"
    script:
        "../scripts/response_surface.py"
