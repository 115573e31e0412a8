//! A campaign of seven runs of 9 s: compared, calibrated and explained.

use std::hint::black_box;
use std::time::Duration;

use blind_benchmark::draw::{DrawSpec, draw};
use blind_score::Drawn;
use criterion::{Criterion, criterion_group, criterion_main};
use identify::Stop;
use model_lab::calibrate::Calibration;
use model_lab::compare::Comparison;
use model_lab::diagnosis::{DiagnoseOptions, explain};
use model_lab::identification::{NuisanceSizes, Subject};

/// Campaigns of the testbed valve with 0.03 mm of noise: with nothing hidden, and with one effect.
fn campaigns() -> [(String, Drawn); 2] {
    let spec = DrawSpec {
        pressures: Some(false),
        repeats: Some(false),
        position_noise_m: Some(0.03e-3),
        testbed_share: 1.0,
        ..DrawSpec::default()
    };
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]].map(|weights| {
        let campaign = draw(1, 0, &DrawSpec { weights, ..spec.clone() });
        let folder = tempfile::tempdir().expect("a folder for the campaign");
        let drawn = Drawn::through_files(&campaign, folder.path()).expect("what is drawn can be read");
        (campaign.name, drawn)
    })
}

fn model_lab(criterion: &mut Criterion) {
    for (name, drawn) in campaigns() {
        let Drawn { file, campaign, data } = &drawn;
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10).measurement_time(Duration::from_secs(5));
        group.bench_function("compare", |b| {
            b.iter(|| {
                let subject = Subject::new(black_box(file), campaign, &NuisanceSizes::default(), Stop::never());
                Comparison::new(&subject, file.valve(), data)
            });
        });
        group.bench_function("calibrate 7 parameters", |b| {
            b.iter(|| Calibration::new(black_box(file), campaign, Stop::never()));
        });
        group.bench_function("explain", |b| {
            b.iter(|| explain(black_box(file), campaign, &DiagnoseOptions::default(), &|_| (), Stop::never()));
        });
        group.finish();
    }
}

criterion_group!(benches, model_lab);
criterion_main!(benches);
