//! A template of Open Job Description, specification `jobtemplate-2023-09`, as JSON (which is YAML as well), without extensions.
//!
//! Paths are parameters of the job, so that the farm can map them from machine to machine. They have no defaults: those could only be relative to
//! wherever the template will lie.

use super::words::check;
use super::{FarmError, InputKind, Job, Paths};
use serde_json::{Value, json};

/// Most values of a task's parameter.
const MOST: usize = 1024;
/// Longest name of a job, characters.
const LONGEST_NAME: usize = 128;
/// Name of the step that renders.
const RENDER: &str = "Render";

/// The template.
pub fn template(job: &Job) -> Result<String, FarmError> {
    job.check_tasks("an Open Job Description", MOST)?;
    let mut parameters = vec![json!({
        "name": "Glyphlight", "type": "STRING", "default": literal(&job.program)?,
        "description": "The program on the machines that render",
    })];
    let mut inputs = Vec::new();
    for (index, input) in job.inputs.iter().enumerate() {
        check(&input.path)?;
        let name = if job.inputs.len() == 1 { "Input".into() } else { format!("Input{}", index + 1) };
        let mut parameter =
            json!({ "name": name, "type": "PATH", "description": about(&format!("Drawings: {}", input.path)) });
        match input.kind {
            InputKind::File => (parameter["objectType"], parameter["dataFlow"]) = ("FILE".into(), "IN".into()),
            InputKind::Folder => (parameter["objectType"], parameter["dataFlow"]) = ("DIRECTORY".into(), "IN".into()),
            InputKind::Pattern => parameter["dataFlow"] = "NONE".into(),
        }
        inputs.push(format!("{{{{Param.{name}}}}}"));
        parameters.push(parameter);
    }
    if let Some(scene) = &job.scene {
        check(scene)?;
        parameters.push(json!({
            "name": "Scene", "type": "PATH", "objectType": "FILE", "dataFlow": "IN",
            "description": about(&format!("Template: {scene}")),
        }));
    }
    check(&job.output)?;
    parameters.push(json!({
        "name": "Out", "type": "PATH", "objectType": "DIRECTORY", "dataFlow": "OUT",
        "description": about(&format!("Folder to write, which all machines share: {}", job.output)),
    }));
    for option in &job.options {
        literal(option)?;
    }
    let paths = Paths {
        program: "{{Param.Glyphlight}}".into(),
        inputs,
        output: "{{Param.Out}}".into(),
        scene: job.scene.as_ref().map(|_| "{{Param.Scene}}".into()),
    };
    let ranges: Vec<String> = job.chunks().map(|items| format!("{}-{}", items.start(), items.end())).collect();
    let template = json!({
        "specificationVersion": "jobtemplate-2023-09",
        "name": name(job),
        "parameterDefinitions": parameters,
        "steps": [
            {
                "name": RENDER,
                "parameterSpace": { "taskParameterDefinitions": [{ "name": "Items", "type": "STRING", "range": ranges }] },
                "script": action(&job.part_command(&paths, "{{Task.Param.Items}}", true)),
            },
            {
                "name": "Merge",
                "dependencies": [{ "dependsOn": RENDER }],
                "script": action(&job.merge_command(&paths, true)),
            },
        ],
    });
    Ok(format!("{template:#}\n"))
}

fn action(words: &[String]) -> Value {
    json!({ "actions": { "onRun": { "command": words[0], "args": words[1..] } } })
}

/// A word in which nothing is to be put in place of anything.
fn literal(word: &str) -> Result<&str, FarmError> {
    check(word)?;
    if word.contains("{{") || word.contains("}}") {
        let reason = "holds {{ or }}, which an Open Job Description cannot say";
        return Err(FarmError::Word { word: word.into(), reason });
    }
    Ok(word)
}

/// The job's name: a format string, so without braces.
fn name(job: &Job) -> String {
    let of = job.inputs.first().map_or("", |input| input.path.as_str());
    let name = format!("glyphlight {}: {of}", job.items).replace(['{', '}'], "_");
    name.chars().take(LONGEST_NAME).collect()
}

/// A description, shortened.
fn about(text: &str) -> String {
    const LONGEST: usize = 2048;
    text.chars().take(LONGEST).collect()
}
