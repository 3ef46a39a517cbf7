//! Images: which of a texture's images is read, and what a specular-glossiness material makes of its own.

use glam::Vec4;
use image::{ImageFormat, RgbaImage};

use super::super::super::model::Scene;
use super::{QUAD, base64, file};

/// A picture of one colour as the JSON of an image.
fn picture(format: ImageFormat, [width, height]: [u32; 2], color: [u8; 4]) -> String {
    let mut bytes = std::io::Cursor::new(Vec::new());
    RgbaImage::from_pixel(width, height, image::Rgba(color)).write_to(&mut bytes, format).unwrap();
    format!(r#"{{"uri":"data:;base64,{}"}}"#, base64(bytes.get_ref()))
}

fn quad(material: &str, rest: &str) -> Scene {
    let rest = format!(
        r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"mode":5,"material":0,"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":4}}],"materials":[{material}],{rest}"#
    );
    file(&QUAD, &[(0, 48)], &rest).unwrap()
}

// Kills: the fallback shown although the better image can be read, and a WebP file taken for something else.
#[test]
fn a_webp_image_is_preferred_to_its_fallback() {
    let (png, webp) = (picture(ImageFormat::Png, [1, 1], [9, 9, 9, 255]), picture(ImageFormat::WebP, [2, 3], [10, 20, 30, 40]));
    let rest = format!(
        r#""images":[{png},{webp}],"textures":[{{"source":0,"extensions":{{"EXT_texture_webp":{{"source":1}}}}}},
            {{"extensions":{{"EXT_texture_webp":{{"source":1}}}}}}],"extensionsRequired":["EXT_texture_webp"]"#
    );
    for texture in [0, 1] {
        let scene = quad(&format!(r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{texture}}}}}}}"#), &rest);
        assert_eq!((scene.images.len(), scene.images[0].width, scene.images[0].height), (1, 2, 3));
        assert!(scene.images[0].texels.iter().all(|&texel| texel == [10, 20, 30, 40]));
    }
}

/// A material of diffuse and specular-glossiness textures; `coordinates` is the set that the second one lies on.
fn glossy(coordinates: u32) -> Scene {
    let images = [picture(ImageFormat::Png, [2, 2], [188, 188, 188, 128]), picture(ImageFormat::Png, [4, 1], [0, 0, 0, 51])].join(",");
    let material = format!(
        r#"{{"extensions":{{"KHR_materials_pbrSpecularGlossiness":{{"diffuseFactor":[1,0.5,0,0.5],"diffuseTexture":{{"index":0}},
            "specularGlossinessTexture":{{"index":1,"texCoord":{coordinates}}}}}}}}}"#
    );
    quad(&material, &format!(r#""images":[{images}],"textures":[{{"source":0}},{{"source":1}}]"#))
}

// Kills: a converted texture in the place of the original one, a factor that is applied twice or not at all, and the size of one image for
// both.
#[test]
fn specular_glossiness_makes_images_of_its_own() {
    let scene = glossy(0);
    let material = &scene.materials[0];
    let image = |used: Option<crate::scene::TextureUse>| &scene.images[used.unwrap().image as usize];
    let (color, surface) = (image(material.base_color_texture), image(material.metallic_roughness_texture));
    assert_eq!((color.width, color.height, surface.width, surface.height), (4, 2, 4, 2));
    assert_eq!((material.base_color, material.metallic, material.roughness), (Vec4::new(1.0, 1.0, 1.0, 0.5), 1.0, 1.0));
    // A black specular colour leaves a dielectric, whose base colour is the diffuse one over 0.96: in sRGB 188 (0.503) becomes 191,
    // and half of it 140.
    assert!(color.texels.iter().all(|&texel| texel == [191, 140, 0, 128]), "{:?}", color.texels);
    assert!(surface.texels.iter().all(|&texel| texel == [255, 204, 0, 255]), "{:?}", surface.texels);
    assert_eq!(scene.warnings, ["KHR_materials_pbrSpecularGlossiness is converted to metallic-roughness"]);
}

// Kills: texels of two layouts mixed as if they lay on each other, and a mean that nobody is told of.
#[test]
fn textures_of_two_layouts_are_not_mixed() {
    let scene = glossy(1);
    let material = &scene.materials[0];
    assert_eq!(material.metallic_roughness_texture, None);
    assert!((material.roughness - 0.8).abs() < 1e-6 && material.metallic == 0.0);
    assert!(material.base_color.abs_diff_eq(Vec4::new(1.0, 0.5 / 0.96, 0.0, 0.5), 1e-6), "{}", material.base_color);
    assert!(scene.warnings.iter().any(|line| line.contains("its mean is used")), "{:?}", scene.warnings);
}
