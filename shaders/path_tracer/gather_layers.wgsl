// Stage, where layers are asked for: notes what the path has met. It reads what the others have found and changes nothing of theirs.

@if(layer_albedo || layer_normal) import package::path_tracer::layer_features::note_features;
@if(layer_depth || layer_position || layer_object || layer_material) import package::path_tracer::layer_first_hit::note_first_hit;
import package::path_tracer::path::Path;

fn gather_layers(path: ptr<function, Path>) {
    @if(layer_albedo || layer_normal) note_features(path);
    @if(layer_depth || layer_position || layer_object || layer_material) if (*path).depth == 0u {
        note_first_hit(path);
    }
}
